//! The power stage of the simulated drive: the state machine of CiA 402 from the drive's side.

use super::super::cia402::{
    CYCLIC_TORQUE, FAULT_RESET, FOLLOWS_TARGET, Order, PROFILE_TORQUE, REMOTE, State,
};

/// State, controlword and mode.
#[derive(Clone, Copy, Debug)]
pub struct Power {
    state: State,
    controlword: u16,
    mode: i8,
    /// Operation stays enabled, but no current flows.
    pub ignores_target: bool,
}

impl Default for Power {
    fn default() -> Self {
        Power {
            state: State::NotReadyToSwitchOn,
            controlword: 0,
            mode: 0,
            ignores_target: false,
        }
    }
}

impl Power {
    /// The state.
    pub fn state(&self) -> State {
        self.state
    }

    /// Mode of operation in force.
    pub fn mode(&self) -> i8 {
        self.mode
    }

    /// Sets the mode of operation.
    pub fn set_mode(&mut self, mode: i8) {
        self.mode = mode;
    }

    /// Whether the target becomes current.
    pub fn follows(&self) -> bool {
        let is_torque = matches!(self.mode, CYCLIC_TORQUE | PROFILE_TORQUE);
        self.state == State::OperationEnabled && is_torque && !self.ignores_target
    }

    /// Takes a controlword: arrows 2 to 12, 15 and 16 of CiA 402.
    pub fn obey(&mut self, controlword: u16) {
        let reset = controlword & !self.controlword & FAULT_RESET != 0;
        self.controlword = controlword;
        match Order::decode(controlword) {
            None if reset && self.state == State::Fault => self.state = State::SwitchOnDisabled, // 15
            None => {}
            Some(order) => self.state = next(self.state, order),
        }
    }

    /// Arrows that need no order: 0, 1, 14.
    pub fn settle(&mut self) {
        self.state = match self.state {
            State::NotReadyToSwitchOn => State::SwitchOnDisabled,
            State::FaultReactionActive => State::Fault,
            other => other,
        };
    }

    /// Arrow 13: a fault.
    pub fn fail(&mut self) {
        if self.state != State::Fault {
            self.state = State::FaultReactionActive;
        }
    }

    /// Arrows 7, 9, 10, 12 from inside.
    pub fn switch_off(&mut self) {
        self.state = next(self.state, Order::DisableVoltage);
    }

    /// Arrow 11 from inside.
    pub fn quick_stop(&mut self) {
        self.state = next(self.state, Order::QuickStop);
    }

    /// The statusword: state, voltage, remote, and whether the target is followed.
    pub fn statusword(&self) -> u16 {
        const VOLTAGE: u16 = 1 << 4;
        let follows = if self.follows() && self.mode == CYCLIC_TORQUE {
            FOLLOWS_TARGET
        } else {
            0
        };
        self.state.bits() | VOLTAGE | REMOTE | follows
    }
}

/// The state after an order; what has no arrow changes nothing.
const fn next(state: State, order: Order) -> State {
    match (state, order) {
        (State::SwitchOnDisabled, Order::Shutdown) => State::ReadyToSwitchOn, // 2
        (State::ReadyToSwitchOn, Order::SwitchOn) => State::SwitchedOn,       // 3
        (State::SwitchedOn, Order::EnableOperation) => State::OperationEnabled, // 4
        (State::ReadyToSwitchOn, Order::EnableOperation) => State::OperationEnabled, // 3 and 4
        (State::OperationEnabled, Order::SwitchOn) => State::SwitchedOn,      // 5
        (State::SwitchedOn, Order::Shutdown) => State::ReadyToSwitchOn,       // 6
        (State::ReadyToSwitchOn, Order::DisableVoltage | Order::QuickStop) => {
            State::SwitchOnDisabled
        } // 7
        (State::OperationEnabled, Order::Shutdown) => State::ReadyToSwitchOn, // 8
        (State::OperationEnabled, Order::DisableVoltage) => State::SwitchOnDisabled, // 9
        (State::SwitchedOn, Order::DisableVoltage | Order::QuickStop) => State::SwitchOnDisabled, // 10
        (State::OperationEnabled, Order::QuickStop) => State::QuickStopActive, // 11
        (State::QuickStopActive, Order::DisableVoltage) => State::SwitchOnDisabled, // 12
        (state, _) => state,
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::cia402::*;
    use super::*;

    fn at(state: State) -> Power {
        Power {
            state,
            controlword: 0,
            mode: CYCLIC_TORQUE,
            ignores_target: false,
        }
    }

    #[test]
    fn each_arrow_of_the_standard_is_taken_and_no_other() {
        use State::*;
        let states = [
            NotReadyToSwitchOn,
            SwitchOnDisabled,
            ReadyToSwitchOn,
            SwitchedOn,
            OperationEnabled,
            QuickStopActive,
            FaultReactionActive,
            Fault,
        ];
        let arrows = [
            (SwitchOnDisabled, SHUTDOWN, ReadyToSwitchOn), // 2
            (ReadyToSwitchOn, SWITCH_ON, SwitchedOn),      // 3
            (ReadyToSwitchOn, ENABLE_OPERATION, OperationEnabled), // 3, 4
            (SwitchedOn, ENABLE_OPERATION, OperationEnabled), // 4
            (OperationEnabled, SWITCH_ON, SwitchedOn),     // 5
            (SwitchedOn, SHUTDOWN, ReadyToSwitchOn),       // 6
            (ReadyToSwitchOn, DISABLE_VOLTAGE, SwitchOnDisabled), // 7
            (ReadyToSwitchOn, QUICK_STOP, SwitchOnDisabled), // 7
            (OperationEnabled, SHUTDOWN, ReadyToSwitchOn), // 8
            (OperationEnabled, DISABLE_VOLTAGE, SwitchOnDisabled), // 9
            (SwitchedOn, DISABLE_VOLTAGE, SwitchOnDisabled), // 10
            (SwitchedOn, QUICK_STOP, SwitchOnDisabled),    // 10
            (OperationEnabled, QUICK_STOP, QuickStopActive), // 11
            (QuickStopActive, DISABLE_VOLTAGE, SwitchOnDisabled), // 12
            (Fault, FAULT_RESET, SwitchOnDisabled),        // 15
        ];
        for state in states {
            for word in [
                DISABLE_VOLTAGE,
                SHUTDOWN,
                SWITCH_ON,
                ENABLE_OPERATION,
                QUICK_STOP,
                FAULT_RESET,
            ] {
                let arrow = arrows
                    .iter()
                    .find(|(from, with, _)| (*from, *with) == (state, word));
                let mut power = at(state);
                power.obey(word);
                assert_eq!(
                    power.state(),
                    arrow.map_or(state, |(_, _, to)| *to),
                    "{state:?} with {word:#06x}"
                );
            }
        }
    }

    #[test]
    fn the_drivers_words_lead_up_in_three_steps_and_back_in_three() {
        let mut power = Power::default();
        power.settle(); // 1
        power.set_mode(CYCLIC_TORQUE);
        let mut up = vec![power.state()];
        while power.state() != State::OperationEnabled {
            power.obey(power.state().towards_enabled().unwrap());
            up.push(power.state());
        }
        use State::*;
        assert_eq!(
            up,
            [
                SwitchOnDisabled,
                ReadyToSwitchOn,
                SwitchedOn,
                OperationEnabled
            ]
        ); // 2, 3, 4
        let mut down = Vec::new();
        while let Some(word) = power.state().towards_disabled() {
            power.obey(word);
            down.push(power.state());
        }
        assert_eq!(down, [SwitchedOn, ReadyToSwitchOn, SwitchOnDisabled]); // 5, 6, 7
    }

    #[test]
    fn quick_stop_and_fault_are_left_only_as_the_standard_says() {
        let mut power = at(State::QuickStopActive);
        power.obey(power.state().towards_enabled().unwrap());
        assert_eq!(power.state(), State::SwitchOnDisabled); // 12
        power.fail(); // 13
        assert_eq!(power.state(), State::FaultReactionActive);
        power.settle(); // 14
        assert_eq!(power.state(), State::Fault);
        power.controlword = FAULT_RESET;
        power.obey(FAULT_RESET);
        assert_eq!(power.state(), State::Fault, "a standing bit is no edge");
        power.obey(0);
        power.obey(FAULT_RESET); // 15
        assert_eq!(power.state(), State::SwitchOnDisabled);
    }

    #[test]
    fn bit_12_says_that_the_target_is_followed_in_cyclic_torque_only() {
        let mut power = at(State::OperationEnabled);
        assert_eq!(
            power.statusword() & (0x6F | FOLLOWS_TARGET | REMOTE),
            0x27 | FOLLOWS_TARGET | REMOTE
        );
        power.set_mode(PROFILE_TORQUE);
        assert!(power.follows() && power.statusword() & FOLLOWS_TARGET == 0);
        power.set_mode(CYCLIC_TORQUE);
        power.ignores_target = true;
        assert!(!power.follows() && power.statusword() & FOLLOWS_TARGET == 0);
    }
}
