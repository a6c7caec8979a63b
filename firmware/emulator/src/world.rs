//! The mechanical truth that servo, encoder and camera share: where the polarizer really is, at any time.
//!
//! A servo follows its pulse at its slew rate. Behind it the gear has play: the polarizer stays where it is until the
//! servo has taken up the backlash, and follows without error on the side of the approach (the zero offset of the board is
//! defined there). Where a motion ends the polarizer rings for a while, and it comes to rest a little off, differently
//! each time.

use crate::Clock;
use crate::noise::Draws;
use boards::{Approach, Board};
use protocol_polar::{Degrees, Radians};
use std::f64::consts::TAU;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Stream of the wheel's random draws.
const JITTER: u64 = 1;
/// Amplitude of the ringing at the end of a motion, degrees at the servo.
const RING_DEG: f64 = 0.5;
/// Its frequency: a plastic gear train with a filter holder on it.
const RING_HZ: f64 = 25.0;
/// Time constants of the ringing within the board's settling time: it dies to 2e-4°.
const RING_DECAYS: f64 = 8.0;

/// The wheel as it really stands and moves. Shared: clones are the same wheel.
#[derive(Clone, Debug)]
pub struct World {
    clock: Clock,
    mechanics: Mechanics,
    state: Arc<Mutex<State>>,
}

#[derive(Clone, Copy, Debug)]
struct Mechanics {
    gear_ratio: f64,
    zero_offset_deg: f64,
    pulse_min_us: f64,
    degrees_per_us: f64,
    travel_deg: f64,
    slew_deg_per_s: f64,
    settle_s: f64,
    pwm_period_s: f64,
    /// Lowest and highest place of the polarizer relative to the servo, servo degrees.
    play_deg: (f64, f64),
    jitter_deg: f64,
    jitter: Draws,
}

#[derive(Clone, Copy, Debug)]
struct State {
    /// The present motion, servo degrees and seconds.
    from_deg: f64,
    to_deg: f64,
    start_s: f64,
    /// Where the polarizer stood when it began, servo degrees.
    follower_deg: f64,
    /// The polarizer turned on its hub, degrees.
    slipped_deg: f64,
    motions: u64,
}

impl World {
    /// The board's wheel at rest in the middle of its travel.
    #[must_use]
    pub fn new(board: &Board, clock: Clock) -> Self {
        let (wheel, servo) = (&board.wheel, &board.wheel.servo);
        let (jitter_deg, seed) = board.emulation.as_ref().map_or((0.0, 0), |e| (e.wheel_jitter_deg, e.seed));
        let play_deg = match servo.approach {
            Approach::Increasing => (0.0, servo.backlash_deg),
            Approach::Decreasing => (-servo.backlash_deg, 0.0),
        };
        let mechanics = Mechanics {
            gear_ratio: wheel.gear_ratio,
            zero_offset_deg: wheel.zero_offset_deg,
            pulse_min_us: servo.pulse_min_us.into(),
            degrees_per_us: servo.travel_deg / f64::from(servo.pulse_max_us - servo.pulse_min_us),
            travel_deg: servo.travel_deg,
            slew_deg_per_s: servo.slew_deg_per_s,
            settle_s: f64::from(servo.settle_ms) * 1e-3,
            pwm_period_s: f64::from(servo.pwm_period_us) * 1e-6,
            play_deg,
            jitter_deg,
            jitter: Draws::new(seed, JITTER),
        };
        let middle = 0.5 * servo.travel_deg;
        let state = State {
            from_deg: middle,
            to_deg: middle,
            start_s: f64::NEG_INFINITY,
            follower_deg: middle,
            slipped_deg: 0.0,
            motions: 0,
        };
        Self { clock, mechanics, state: Arc::new(Mutex::new(state)) }
    }

    /// The clock everything here goes by.
    #[must_use]
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// The polarizer's true axis now, not wrapped.
    #[must_use]
    pub fn axis(&self) -> Degrees {
        let now_s = self.clock.elapsed().as_secs_f64();
        let state = *self.state();
        let m = &self.mechanics;
        let servo_deg = m.follower(&state, now_s) + m.ringing(&state, now_s);
        Degrees(m.zero_offset_deg + state.slipped_deg + m.gear_ratio * servo_deg)
    }

    /// The same as an axis, [0, π).
    #[must_use]
    pub fn axis_radians(&self) -> Radians {
        self.axis().to_radians().as_axis()
    }

    /// What the servo does on a pulse of this length; one far too short (0: no pulses) leaves it where it is.
    pub fn pulse(&self, pulse_us: f64) {
        let m = &self.mechanics;
        if pulse_us < 0.5 * m.pulse_min_us {
            return;
        }
        let now_s = self.clock.elapsed().as_secs_f64();
        let mut state = self.state();
        let follower_deg = m.follower(&state, now_s);
        let from_deg = m.servo(&state, now_s);
        let wanted = ((pulse_us - m.pulse_min_us) * m.degrees_per_us).clamp(0.0, m.travel_deg);
        let off_deg = m.jitter_deg * f64::from(m.jitter.normal(state.motions)) / m.gear_ratio;
        *state = State {
            from_deg,
            to_deg: wanted + off_deg,
            // The servo measures the next pulse of its signal.
            start_s: now_s + m.pwm_period_s,
            follower_deg,
            slipped_deg: state.slipped_deg,
            motions: state.motions + 1,
        };
    }

    /// Turns the polarizer on its hub by `angle`, as when its glue lets go (or when somebody sets it right again).
    pub fn slip(&self, angle: Degrees) {
        self.state().slipped_deg += angle.0;
    }

    /// A panic elsewhere cannot leave the wheel half moved.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Mechanics {
    fn travel_s(&self, state: &State) -> f64 {
        (state.to_deg - state.from_deg).abs() / self.slew_deg_per_s
    }

    /// Servo angle at `now_s`.
    fn servo(&self, state: &State, now_s: f64) -> f64 {
        let under_way_s = (now_s - state.start_s).max(0.0);
        let way_deg = state.to_deg - state.from_deg;
        if under_way_s >= self.travel_s(state) {
            state.to_deg
        } else {
            state.from_deg + way_deg.signum() * self.slew_deg_per_s * under_way_s
        }
    }

    /// Where the polarizer is, in servo degrees: what play leaves of where it was. (A motion is monotone, so only its
    /// beginning and its present count.)
    fn follower(&self, state: &State, now_s: f64) -> f64 {
        let servo_deg = self.servo(state, now_s);
        let (low, high) = self.play_deg;
        state.follower_deg.clamp(servo_deg + low, servo_deg + high)
    }

    fn ringing(&self, state: &State, now_s: f64) -> f64 {
        let at_rest_s = now_s - state.start_s - self.travel_s(state);
        if !(0.0..self.settle_s.max(0.0) * 4.0).contains(&at_rest_s) {
            return 0.0;
        }
        RING_DEG * (-RING_DECAYS * at_rest_s / self.settle_s).exp() * (TAU * RING_HZ * at_rest_s).sin()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use std::time::Duration;

    fn world(edit: impl FnOnce(&mut Board)) -> World {
        let mut board = Board::parse(boards::EMULATED_TOML, Path::new("emulated.toml")).unwrap();
        board.emulation.as_mut().unwrap().wheel_jitter_deg = 0.0;
        edit(&mut board);
        World::new(&board, Clock::virtual_time())
    }

    /// Sends a pulse and waits until all is still.
    fn rest(world: &World, pulse_us: f64) -> f64 {
        world.pulse(pulse_us);
        world.clock().wait(Duration::from_secs(5));
        world.axis().0
    }

    #[test]
    fn the_approach_side_is_exact_and_the_other_off_by_the_play() {
        let wheel = world(|_| {});
        rest(&wheel, 800.0);
        let up = rest(&wheel, 1500.0);
        assert!((up - (-50.0 + 1.5 * 90.0)).abs() < 1e-9, "{up}");
        rest(&wheel, 2000.0);
        let down = rest(&wheel, 1500.0);
        assert!((down - up - 1.5).abs() < 1e-9, "one servo degree of play at gear 1.5: {down} after {up}");
    }

    #[test]
    fn it_takes_its_time_and_rings() {
        let wheel = world(|_| {});
        rest(&wheel, 800.0);
        wheel.pulse(1800.0); // 90° of servo: 0.3 s and one signal period
        wheel.clock().wait(Duration::from_millis(170));
        let half_way = wheel.axis().0;
        assert!((half_way - (-50.0 + 1.5 * 72.0)).abs() < 1e-6, "{half_way}");
        wheel.clock().wait(Duration::from_millis(160));
        let ringing = wheel.axis().0 - (-50.0 + 1.5 * 117.0);
        wheel.clock().wait(Duration::from_millis(80));
        let still = wheel.axis().0 - (-50.0 + 1.5 * 117.0);
        assert!(ringing.abs() > 0.1 && still.abs() < 1e-3, "{ringing} then {still}");
    }

    #[test]
    fn rests_scatter_as_the_board_says() {
        let wheel = world(|board| board.emulation.as_mut().unwrap().wheel_jitter_deg = 0.3);
        let offs: Vec<f64> = (0..4000)
            .map(|_| {
                rest(&wheel, 800.0);
                rest(&wheel, 1500.0) - 85.0
            })
            .collect();
        let variance = offs.iter().map(|x| x * x).sum::<f64>() / offs.len() as f64;
        assert!((variance.sqrt() - 0.3).abs() < 0.02, "{}", variance.sqrt());
    }
}
