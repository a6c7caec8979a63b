//! The capture sequence: meter, lock, take every frame, compute every strip. A state machine; whoever holds it acts.

use crate::exposure::{ExposureSearch, Level, Verdict};
use protocol_wire::{Progress, Stage};

/// What to do next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Action {
    /// Turn to the axis of frame `frame`, expose, and report the level.
    Meter {
        /// Frame number.
        frame: u8,
        /// Exposure of a frame with ratio 1, µs.
        reference_us: u32,
    },
    /// Turn to the axis of frame `frame`, expose, and keep the picture in the slot of the same number.
    Take {
        /// Frame number.
        frame: u8,
        /// Exposure of a frame with ratio 1, µs.
        reference_us: u32,
    },
    /// Compute this strip.
    Compute {
        /// Strip number.
        strip: u16,
    },
    /// All is there.
    Finish,
    /// Half of the picture clips at the shortest exposure.
    GiveUpTooBright,
}

#[derive(Clone, Copy, Debug)]
enum Phase {
    Metering { search: ExposureSearch, frame: u8 },
    Taking { reference_us: u32, frame: u8 },
    Computing { strip: u16 },
    Finished,
    TooBright,
}

/// One capture's course.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sequence {
    frames: u8,
    strips: u16,
    clips: bool,
    phase: Phase,
}

impl Sequence {
    /// A capture of `frames` frames and `strips` strips that finds its exposure first.
    #[must_use]
    pub(crate) fn metered(frames: u8, strips: u16, search: ExposureSearch) -> Self {
        Self { frames, strips, clips: false, phase: Phase::Metering { search, frame: 0 } }
    }

    /// A capture at a given exposure, µs.
    #[must_use]
    pub(crate) fn fixed(frames: u8, strips: u16, reference_us: u32) -> Self {
        Self { frames, strips, clips: false, phase: Phase::Taking { reference_us, frame: 0 } }
    }

    /// The next thing to do; the same until it is reported done.
    #[must_use]
    pub(crate) fn next(&self) -> Action {
        match self.phase {
            Phase::Metering { search, frame } => Action::Meter { frame, reference_us: search.exposure_us() },
            Phase::Taking { reference_us, frame } => Action::Take { frame, reference_us },
            Phase::Computing { strip } => Action::Compute { strip },
            Phase::Finished => Action::Finish,
            Phase::TooBright => Action::GiveUpTooBright,
        }
    }

    /// The metering picture was taken and is this bright.
    pub(crate) fn metered_at(&mut self, level: Level) {
        let Phase::Metering { search, frame } = &mut self.phase else { return };
        search.observe(level);
        *frame += 1;
        if *frame < self.frames {
            return;
        }
        *frame = 0;
        match search.decide() {
            Verdict::Again(_) => {}
            Verdict::Locked { exposure_us, clips } => {
                self.clips = clips;
                self.phase = Phase::Taking { reference_us: exposure_us, frame: 0 };
            }
            Verdict::TooBright => self.phase = Phase::TooBright,
        }
    }

    /// The frame is in its slot.
    pub(crate) fn taken(&mut self) {
        let Phase::Taking { frame, .. } = &mut self.phase else { return };
        *frame += 1;
        if *frame == self.frames {
            self.phase = Phase::Computing { strip: 0 };
        }
    }

    /// The strip is stored.
    pub(crate) fn computed(&mut self) {
        let Phase::Computing { strip } = &mut self.phase else { return };
        *strip += 1;
        if *strip == self.strips {
            self.phase = Phase::Finished;
        }
    }

    /// Whether something clips at the locked exposure.
    #[must_use]
    pub(crate) fn clips(&self) -> bool {
        self.clips
    }

    /// How far it is.
    #[must_use]
    pub(crate) fn progress(&self) -> Progress {
        let (stage, done, total) = match self.phase {
            Phase::Metering { frame, .. } => (Stage::Metering, frame.into(), self.frames.into()),
            Phase::Taking { frame, .. } => (Stage::Exposing, frame.into(), self.frames.into()),
            Phase::Computing { strip } => (Stage::Computing, strip, self.strips),
            Phase::Finished | Phase::TooBright => (Stage::Computing, self.strips, self.strips),
        };
        Progress { stage, done, total }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_frame_and_strip_comes_once_in_order() {
        let mut sequence = Sequence::fixed(3, 2, 500);
        for frame in 0..3 {
            assert_eq!(sequence.next(), Action::Take { frame, reference_us: 500 });
            sequence.taken();
        }
        for strip in 0..2 {
            assert_eq!(sequence.next(), Action::Compute { strip });
            sequence.computed();
        }
        assert_eq!(sequence.next(), Action::Finish);
        sequence.computed();
        assert_eq!(sequence.next(), Action::Finish, "a stray report changes nothing");
    }

    #[test]
    fn the_exposure_is_locked_by_the_brightest_angle() {
        let search = ExposureSearch::new(1000, (10, 100_000), (0, 4000));
        let mut sequence = Sequence::metered(2, 1, search);
        for peak_dn in [1000, 1700] {
            assert!(matches!(sequence.next(), Action::Meter { reference_us: 1000, .. }));
            sequence.metered_at(Level { peak_dn, clipped: 0 });
        }
        // 85 % of 4000 DN is 3400: twice the brighter angle's 1700.
        assert_eq!(sequence.next(), Action::Take { frame: 0, reference_us: 2000 });
    }
}
