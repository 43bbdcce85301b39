//! The power stage of the emulated drive: the state machine of CiA 402 from the side of the drive.
//!
//! The numbers are those of the transitions in CiA 402.

use super::super::cia402::{
    CYCLIC_TORQUE, Command, FAULT_RESET, FOLLOWS_TARGET, PROFILE_TORQUE, REMOTE, State,
};

/// State, controlword and mode.
#[derive(Clone, Copy, Debug)]
pub(super) struct PowerStage {
    state: State,
    controlword: u16,
    mode: i8,
    /// Operation stays enabled, but no current flows.
    pub(super) ignores_target: bool,
}

impl Default for PowerStage {
    fn default() -> Self {
        PowerStage {
            state: State::NotReadyToSwitchOn,
            controlword: 0,
            mode: 0,
            ignores_target: false,
        }
    }
}

impl PowerStage {
    /// The state.
    pub(super) fn state(&self) -> State {
        self.state
    }

    /// Sets the mode of operation.
    pub(super) fn set_mode(&mut self, mode: i8) {
        self.mode = mode;
    }

    /// Whether the current follows the target.
    pub(super) fn follows(&self) -> bool {
        let is_torque = matches!(self.mode, CYCLIC_TORQUE | PROFILE_TORQUE);
        self.state == State::OperationEnabled && is_torque && !self.ignores_target
    }

    /// Takes a controlword: transitions 2 to 12, 15 and 16.
    pub(super) fn take_controlword(&mut self, controlword: u16) {
        let reset = controlword & !self.controlword & FAULT_RESET != 0;
        self.controlword = controlword;
        match Command::decode(controlword) {
            None if reset && self.state == State::Fault => self.state = State::SwitchOnDisabled, // 15
            None => {}
            Some(command) => self.state = next(self.state, command),
        }
    }

    /// Automatic transitions: 0, 1, 14.
    pub(super) fn advance(&mut self) {
        self.state = match self.state {
            State::NotReadyToSwitchOn => State::SwitchOnDisabled,
            State::FaultReactionActive => State::Fault,
            other => other,
        };
    }

    /// A fault: transition 13.
    pub(super) fn fail(&mut self) {
        if self.state != State::Fault {
            self.state = State::FaultReactionActive;
        }
    }

    /// Switches off without a command: transitions 7, 9, 10, 12.
    pub(super) fn switch_off(&mut self) {
        self.state = next(self.state, Command::DisableVoltage);
    }

    /// Quick stop without a command: transition 11.
    pub(super) fn quick_stop(&mut self) {
        self.state = next(self.state, Command::QuickStop);
    }

    /// The statusword: state, voltage, remote, target followed.
    pub(super) fn statusword(&self) -> u16 {
        const VOLTAGE: u16 = 1 << 4;
        let follows = if self.follows() && self.mode == CYCLIC_TORQUE {
            FOLLOWS_TARGET
        } else {
            0
        };
        self.state.bits() | VOLTAGE | REMOTE | follows
    }
}

/// The transitions by command, with their numbers in CiA 402.
#[rustfmt::skip]
const TRANSITIONS: [(State, Command, State); 14] = [
    (State::SwitchOnDisabled, Command::Shutdown,        State::ReadyToSwitchOn),  // 2
    (State::ReadyToSwitchOn,  Command::SwitchOn,        State::SwitchedOn),       // 3
    (State::SwitchedOn,       Command::EnableOperation, State::OperationEnabled), // 4
    (State::ReadyToSwitchOn,  Command::EnableOperation, State::OperationEnabled), // 3 and 4
    (State::OperationEnabled, Command::SwitchOn,        State::SwitchedOn),       // 5
    (State::SwitchedOn,       Command::Shutdown,        State::ReadyToSwitchOn),  // 6
    (State::ReadyToSwitchOn,  Command::DisableVoltage,  State::SwitchOnDisabled), // 7
    (State::ReadyToSwitchOn,  Command::QuickStop,       State::SwitchOnDisabled), // 7
    (State::OperationEnabled, Command::Shutdown,        State::ReadyToSwitchOn),  // 8
    (State::OperationEnabled, Command::DisableVoltage,  State::SwitchOnDisabled), // 9
    (State::SwitchedOn,       Command::DisableVoltage,  State::SwitchOnDisabled), // 10
    (State::SwitchedOn,       Command::QuickStop,       State::SwitchOnDisabled), // 10
    (State::OperationEnabled, Command::QuickStop,       State::QuickStopActive),  // 11
    (State::QuickStopActive,  Command::DisableVoltage,  State::SwitchOnDisabled), // 12
];

/// The state after a command; a command without a transition is ignored.
fn next(state: State, command: Command) -> State {
    let transition = TRANSITIONS
        .iter()
        .find(|(from, with, _)| (*from, *with) == (state, command));
    transition.map_or(state, |(_, _, to)| *to)
}

#[cfg(test)]
mod tests {
    use super::super::super::cia402::*;
    use super::*;

    fn at(state: State) -> PowerStage {
        PowerStage {
            state,
            controlword: 0,
            mode: CYCLIC_TORQUE,
            ignores_target: false,
        }
    }

    #[test]
    fn has_exactly_the_transitions_of_the_standard() {
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
        let transitions = [
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
                let transition = transitions
                    .iter()
                    .find(|(from, with, _)| (*from, *with) == (state, word));
                let mut power = at(state);
                power.take_controlword(word);
                assert_eq!(
                    power.state(),
                    transition.map_or(state, |(_, _, to)| *to),
                    "{state:?} with {word:#06x}"
                );
            }
        }
    }

    #[test]
    fn controlwords_of_the_driver_enable_and_disable_in_three_steps() {
        let mut power = PowerStage::default();
        power.advance(); // 1
        power.set_mode(CYCLIC_TORQUE);
        let mut up = vec![power.state()];
        while power.state() != State::OperationEnabled {
            power.take_controlword(power.state().towards_enabled().unwrap());
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
            power.take_controlword(word);
            down.push(power.state());
        }
        assert_eq!(down, [SwitchedOn, ReadyToSwitchOn, SwitchOnDisabled]); // 5, 6, 7
    }

    #[test]
    fn leaves_quick_stop_and_fault_only_by_the_transitions_of_the_standard() {
        let mut power = at(State::QuickStopActive);
        power.take_controlword(power.state().towards_enabled().unwrap());
        assert_eq!(power.state(), State::SwitchOnDisabled); // 12
        power.fail(); // 13
        assert_eq!(power.state(), State::FaultReactionActive);
        power.advance(); // 14
        assert_eq!(power.state(), State::Fault);
        power.controlword = FAULT_RESET;
        power.take_controlword(FAULT_RESET);
        assert_eq!(power.state(), State::Fault, "a constant bit is not an edge");
        power.take_controlword(0);
        power.take_controlword(FAULT_RESET); // 15
        assert_eq!(power.state(), State::SwitchOnDisabled);
    }

    #[test]
    fn bit_12_reports_a_followed_target_in_cyclic_torque_only() {
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
