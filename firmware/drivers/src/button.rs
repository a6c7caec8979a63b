//! A push button, debounced.

use embedded_hal::digital::InputPin;

/// Level of the pin while the button is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Active {
    /// Button to ground, pull-up resistor.
    Low,
    /// Button to the supply, pull-down resistor.
    High,
}

/// What the button did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edge {
    /// It was pushed.
    Pressed,
    /// It was let go.
    Released,
}

/// A button whose contacts bounce: a change counts once the pin has shown it, unbroken, for a stated time.
///
/// A button already held at the first poll is no press: a stuck button must not start captures.
#[derive(Debug)]
pub struct Button<PIN> {
    pin: PIN,
    active: Active,
    stable_us: u32,
    state: Option<State>,
}

#[derive(Clone, Copy, Debug)]
struct State {
    held: bool,
    /// Since when the pin has shown the other level, if it does.
    changed_at_us: Option<u64>,
}

impl<PIN: InputPin> Button<PIN> {
    /// `stable_us`: how long a level must last to be believed; contacts bounce for 1 to 10 ms.
    pub const fn new(pin: PIN, active: Active, stable_us: u32) -> Self {
        Self { pin, active, stable_us, state: None }
    }

    /// Looks at the pin. `now_us` is any clock that does not run backwards; poll more often than `stable_us`.
    ///
    /// # Errors
    /// The pin's own error; the state is as before the call.
    pub fn poll(&mut self, now_us: u64) -> Result<Option<Edge>, PIN::Error> {
        let seen_held = match self.active {
            Active::Low => self.pin.is_low()?,
            Active::High => self.pin.is_high()?,
        };
        let Some(state) = &mut self.state else {
            self.state = Some(State { held: seen_held, changed_at_us: None });
            return Ok(None);
        };
        if seen_held == state.held {
            state.changed_at_us = None;
            return Ok(None);
        }
        let since_us = *state.changed_at_us.get_or_insert(now_us);
        if now_us.saturating_sub(since_us) < u64::from(self.stable_us) {
            return Ok(None);
        }
        *state = State { held: seen_held, changed_at_us: None };
        Ok(Some(if seen_held { Edge::Pressed } else { Edge::Released }))
    }

    /// Gives the pin back.
    pub fn release(self) -> PIN {
        self.pin
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_hal_mock::eh1::MockError;
    use embedded_hal_mock::eh1::digital::{Mock, State as Level, Transaction};
    use std::io::ErrorKind;
    use std::vec::Vec;

    const STABLE_US: u32 = 5000;

    /// Polls every millisecond with the pin at `levels`; the edges seen, with their times in ms.
    fn edges(active: Active, levels: &[Level]) -> Vec<(usize, Edge)> {
        let script: Vec<_> = levels.iter().map(|l| Transaction::get(*l)).collect();
        let mut button = Button::new(Mock::new(&script), active, STABLE_US);
        let seen = (0..levels.len())
            .filter_map(|ms| button.poll(1000 * u64::try_from(ms).unwrap()).unwrap().map(|edge| (ms, edge)))
            .collect();
        button.release().done();
        seen
    }

    fn levels(pattern: &str) -> Vec<Level> {
        pattern.chars().map(|c| if c == '_' { Level::Low } else { Level::High }).collect()
    }

    #[test]
    fn a_bouncing_press_and_release_are_one_edge_each() {
        //            at ms  0   3 5        14      22 24
        let pattern = levels("^^^_^_________^^^^^^^^_^^^^^^^^");
        assert_eq!(edges(Active::Low, &pattern), [(10, Edge::Pressed), (19, Edge::Released)]);
    }

    #[test]
    fn both_polarities_see_the_same_button() {
        let pattern = levels("___^_^^^^^^^^^______________");
        assert_eq!(edges(Active::High, &pattern), [(10, Edge::Pressed), (19, Edge::Released)]);
    }

    #[test]
    fn a_glitch_shorter_than_the_stable_time_is_nothing() {
        assert_eq!(edges(Active::Low, &levels("^^^_____^^^^____^^^^")), []);
    }

    #[test]
    fn a_button_held_at_power_up_is_no_press() {
        assert_eq!(
            edges(Active::Low, &levels("__________^^^^^^^^________")),
            [(15, Edge::Released), (23, Edge::Pressed)]
        );
    }

    #[test]
    fn a_pin_error_changes_nothing() {
        let script = [
            Transaction::get(Level::High),
            Transaction::get(Level::Low),
            Transaction::get(Level::Low).with_error(MockError::Io(ErrorKind::NotConnected)),
            Transaction::get(Level::Low),
        ];
        let mut button = Button::new(Mock::new(&script), Active::Low, STABLE_US);
        assert_eq!(button.poll(0), Ok(None));
        assert_eq!(button.poll(1000), Ok(None));
        assert_eq!(button.poll(2000), Err(MockError::Io(ErrorKind::NotConnected)));
        assert_eq!(button.poll(6000), Ok(Some(Edge::Pressed)));
        button.release().done();
    }
}
