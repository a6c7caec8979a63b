//! Play of the wheel: a position reached clockwise is missed by the play b, one reached counter-clockwise is exact (the
//! direction it is calibrated in, and that of the very first move). A wheel that always approaches from one side has none.
//!
//! Bound: as for an angle error of b in those frames, t P |sin b| s0.

use protocol_polar::Radians;

use crate::frames::FrameSpec;
use crate::scene::{Approach, Scene};
use crate::{Assessment, Facts};

/// How far beyond the commanded angle play leaves the wheel.
pub(crate) fn error(scene: &Scene, frame: &FrameSpec) -> Radians {
    let angles = &scene.plan.angles;
    let clockwise = frame.angle > 0 && angles[frame.angle].0 < angles[frame.angle - 1].0;
    let missed = clockwise && scene.wheel.approach == Approach::Direct;
    if missed { scene.wheel.backlash } else { Radians(0.0) }
}

pub(crate) fn assess(facts: &Facts<'_>) -> Assessment {
    let bound = facts.deterministic(|frame| facts.max_dolp * error(facts.scene, frame).0.sin());
    let (wheel, missed) = (&facts.scene.wheel, facts.frames.iter().filter(|f| error(facts.scene, f).0 > 0.0).count());
    let reason = match wheel.approach {
        Approach::OneSided => "every position is approached from one side".to_owned(),
        Approach::Direct => {
            format!("{missed} frames after a clockwise move, play {:.2}°", wheel.backlash.to_degrees().0)
        }
    };
    Assessment::new(bound, 0.0, reason)
}

#[cfg(test)]
mod tests {
    use crate::Effect;
    use crate::frames::testing::{check_bound, studio};
    use crate::scene::Approach;
    use proptest::prelude::*;
    use protocol_polar::Degrees;

    proptest! {
        #[test]
        fn the_bound_holds(play in 0.0..10.0, seed in 0_u64..1000, first in 0.0..180.0) {
            let mut scene = studio(seed);
            scene.wheel.backlash = Degrees(play).to_radians();
            scene.wheel.approach = Approach::Direct;
            scene.plan.angles = [first, 120.0, 60.0, 0.0].map(|a| Degrees(a).to_radians()).into();
            check_bound(&scene, Effect::Backlash)?;
        }
    }

    #[test]
    fn one_sided_approach_has_no_play() {
        let mut scene = studio(1);
        scene.wheel.backlash = Degrees(5.0).to_radians();
        scene.plan.angles.reverse();
        scene.wheel.approach = Approach::OneSided;
        let (with_play, assessed) = check_bound(&scene, Effect::Backlash).unwrap();
        assert!(!assessed.applies && with_play < 1e-9);
        scene.wheel.approach = Approach::Direct;
        let (with_play, assessed) = check_bound(&scene, Effect::Backlash).unwrap();
        assert!(assessed.applies && with_play > 1e-3, "{with_play}");
    }
}
