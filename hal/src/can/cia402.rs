//! The state machine of a drive (CiA 402-2, 7): from power-on to current, and back.
//!
//! ```text
//!            0 start                               13 fault, from everywhere
//!              v                                       v
//!        NotReadyToSwitchOn                    FaultReactionActive
//!              | 1 by itself                           | 14 by itself
//!              v            15 fault reset             v
//!        SwitchOnDisabled <-------------------------- Fault
//!           |  ^  ^  ^
//!        2  |  |7 |  +-- 12 disable voltage ----------------+
//!  shutdown |  |  |                                         |
//!           v  |  | 9, 10                             QuickStopActive
//!        ReadyToSwitchOn <-- 8 shutdown -----+           ^
//!         3 |  ^ 6 shutdown                  |           | 11 quick stop
//!           v  |                             |           |
//!        SwitchedOn -- 4 enable operation --> OperationEnabled
//!                   <- 5 disable operation --
//! ```
//!
//! Current flows in OperationEnabled, and for braking in QuickStopActive and FaultReactionActive. The drivers switch the current
//! off by `disable voltage`, transitions 9 and 10, because it is the fastest way. They use transition 15 only on request of the
//! operator.
//!
//! Statusword 0x6041: the state is in the bits of mask 0x4F or 0x6F. Controlword 0x6040: 0x06 shutdown, 0x07 switch on or
//! disable operation, 0x0F enable operation, 0x02 quick stop, 0x00 disable voltage, rising bit 7 fault reset.

/// Controlword: disable voltage (7, 9, 10, 12).
pub const DISABLE_VOLTAGE: u16 = 0x00;
/// Controlword: shutdown (2, 6, 8).
pub const SHUTDOWN: u16 = 0x06;
/// Controlword: switch on (3), disable operation (5).
pub const SWITCH_ON: u16 = 0x07;
/// Controlword: enable operation (4); also the controlword of every set-point.
pub const ENABLE_OPERATION: u16 = 0x0F;
/// Controlword: quick stop (11).
pub const QUICK_STOP: u16 = 0x02;
/// Controlword: fault reset (15), on the rising edge of this bit.
pub const FAULT_RESET: u16 = 0x80;

/// Statusword, bit 9: the drive accepts its controlword.
pub const REMOTE: u16 = 1 << 9;
/// Statusword, bit 12, in cyclic synchronous torque: the drive follows the target.
pub const FOLLOWS_TARGET: u16 = 1 << 12;

/// Mode of operation 4 of 0x6060: profile torque, with the slope 0x6087 on the way to the target.
pub const PROFILE_TORQUE: i8 = 4;
/// Mode of operation 10 of 0x6060: cyclic synchronous torque.
pub const CYCLIC_TORQUE: i8 = 10;

/// State of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// The drive initialises.
    NotReadyToSwitchOn,
    /// Waiting for `shutdown`.
    SwitchOnDisabled,
    /// Power may be switched on.
    ReadyToSwitchOn,
    /// Power is on, no current.
    SwitchedOn,
    /// The drive follows its target.
    OperationEnabled,
    /// The drive brakes, or has braked.
    QuickStopActive,
    /// The drive brakes because of a fault.
    FaultReactionActive,
    /// The drive is off because of a fault.
    Fault,
}

impl State {
    /// Decodes a statusword: mask 0x4F identifies four states, mask 0x6F the others. `None` for values without a state.
    pub const fn decode(statusword: u16) -> Option<State> {
        match (statusword & 0x4F, statusword & 0x6F) {
            (0x00, _) => Some(State::NotReadyToSwitchOn),
            (0x40, _) => Some(State::SwitchOnDisabled),
            (0x0F, _) => Some(State::FaultReactionActive),
            (0x08, _) => Some(State::Fault),
            (_, 0x21) => Some(State::ReadyToSwitchOn),
            (_, 0x23) => Some(State::SwitchedOn),
            (_, 0x27) => Some(State::OperationEnabled),
            (_, 0x07) => Some(State::QuickStopActive),
            _ => None,
        }
    }

    /// The name in CiA 402.
    pub const fn name(self) -> &'static str {
        match self {
            State::NotReadyToSwitchOn => "not ready to switch on",
            State::SwitchOnDisabled => "switch on disabled",
            State::ReadyToSwitchOn => "ready to switch on",
            State::SwitchedOn => "switched on",
            State::OperationEnabled => "operation enabled",
            State::QuickStopActive => "quick stop active",
            State::FaultReactionActive => "fault reaction active",
            State::Fault => "fault",
        }
    }

    /// The bits of this state in a statusword.
    pub const fn bits(self) -> u16 {
        match self {
            State::NotReadyToSwitchOn => 0x00,
            State::SwitchOnDisabled => 0x40,
            State::ReadyToSwitchOn => 0x21,
            State::SwitchedOn => 0x23,
            State::OperationEnabled => 0x27,
            State::QuickStopActive => 0x07,
            State::FaultReactionActive => 0x0F,
            State::Fault => 0x08,
        }
    }

    /// The controlword of the next step towards OperationEnabled; `None` if a controlword cannot leave this state.
    pub const fn towards_enabled(self) -> Option<u16> {
        match self {
            State::SwitchOnDisabled => Some(SHUTDOWN),
            State::ReadyToSwitchOn => Some(SWITCH_ON),
            State::SwitchedOn | State::OperationEnabled => Some(ENABLE_OPERATION),
            State::QuickStopActive => Some(DISABLE_VOLTAGE),
            State::NotReadyToSwitchOn | State::FaultReactionActive | State::Fault => None,
        }
    }

    /// The controlword of the next single step towards off; `None` if the drive is off already. [`DISABLE_VOLTAGE`] takes all
    /// steps at once.
    pub const fn towards_disabled(self) -> Option<u16> {
        match self {
            State::OperationEnabled => Some(SWITCH_ON),
            State::SwitchedOn => Some(SHUTDOWN),
            State::ReadyToSwitchOn | State::QuickStopActive => Some(DISABLE_VOLTAGE),
            State::SwitchOnDisabled
            | State::NotReadyToSwitchOn
            | State::FaultReactionActive
            | State::Fault => None,
        }
    }

    /// Whether the drive has a fault.
    pub const fn is_fault(self) -> bool {
        matches!(self, State::Fault | State::FaultReactionActive)
    }

    /// Whether the power stage certainly gives no current.
    pub const fn is_off(self) -> bool {
        !matches!(
            self,
            State::OperationEnabled | State::QuickStopActive | State::FaultReactionActive
        )
    }
}

/// The command in a controlword (CiA 402-2, table 5), apart from fault reset, which is an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// 0xxx x110
    Shutdown,
    /// 0xxx 0111, also `disable operation`
    SwitchOn,
    /// 0xxx 1111
    EnableOperation,
    /// 0xxx xx0x
    DisableVoltage,
    /// 0xxx x01x
    QuickStop,
}

impl Command {
    /// Decodes a controlword; `None` while bit 7 is set.
    pub const fn decode(controlword: u16) -> Option<Command> {
        match controlword & 0x8F {
            word if word & 0x80 != 0 => None,
            word if word & 0x02 == 0 => Some(Command::DisableVoltage),
            word if word & 0x04 == 0 => Some(Command::QuickStop),
            word if word & 0x01 == 0 => Some(Command::Shutdown),
            0x07 => Some(Command::SwitchOn),
            _ => Some(Command::EnableOperation),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [State; 8] = [
        State::NotReadyToSwitchOn,
        State::SwitchOnDisabled,
        State::ReadyToSwitchOn,
        State::SwitchedOn,
        State::OperationEnabled,
        State::QuickStopActive,
        State::FaultReactionActive,
        State::Fault,
    ];

    #[test]
    fn decodes_statuswords_with_their_masks() {
        for state in ALL {
            assert_eq!(State::decode(state.bits()), Some(state));
            // Bits 4, 7 and 8 to 15 have other meanings.
            assert_eq!(State::decode(state.bits() | 0xFF90), Some(state));
        }
        // Mask 0x4F ignores bit 5 (quick stop).
        assert_eq!(State::decode(0x60), Some(State::SwitchOnDisabled));
        assert_eq!(State::decode(0x28), Some(State::Fault));
        assert_eq!(State::decode(0x2F), Some(State::FaultReactionActive));
        assert_eq!(
            State::decode(0x01),
            None,
            "ready without the quick-stop bit is no state"
        );
        assert_eq!(
            State::decode(0x48),
            None,
            "fault and switch-on disabled at once is no state"
        );
    }

    #[test]
    fn only_0x27_is_operation_enabled() {
        for word in 0..=u16::MAX {
            let enabled = State::decode(word) == Some(State::OperationEnabled);
            assert_eq!(enabled, word & 0x6F == 0x27);
        }
    }

    #[test]
    fn controlwords_match_cia_402() {
        let words = [
            SHUTDOWN,
            SWITCH_ON,
            ENABLE_OPERATION,
            DISABLE_VOLTAGE,
            QUICK_STOP,
        ]
        .map(Command::decode);
        use Command::*;
        assert_eq!(
            words,
            [
                Shutdown,
                SwitchOn,
                EnableOperation,
                DisableVoltage,
                QuickStop
            ]
            .map(Some)
        );
        assert_eq!(Command::decode(FAULT_RESET | ENABLE_OPERATION), None);
        assert_eq!(
            Command::decode(0x0D),
            Some(DisableVoltage),
            "without bit 1 there is no voltage"
        );
    }

    #[test]
    fn bits_of_the_statusword_match_cia_402() {
        assert_eq!((REMOTE, FOLLOWS_TARGET), (0x0200, 0x1000));
    }

    #[test]
    fn power_stage_may_give_current_in_three_states_only() {
        let may_give = |state: &State| !state.is_off();
        let states: Vec<State> = ALL.into_iter().filter(may_give).collect();
        let [enabled, quick_stop, reaction] = states[..] else {
            panic!("{states:?}")
        };
        assert_eq!(enabled, State::OperationEnabled);
        assert_eq!(quick_stop, State::QuickStopActive);
        assert_eq!(reaction, State::FaultReactionActive);
    }

    #[test]
    fn states_have_the_names_of_cia_402() {
        let names = ALL.map(|state| (state.bits(), state.name()));
        let expected = [
            (0x00, "not ready to switch on"),
            (0x40, "switch on disabled"),
            (0x21, "ready to switch on"),
            (0x23, "switched on"),
            (0x27, "operation enabled"),
            (0x07, "quick stop active"),
            (0x0F, "fault reaction active"),
            (0x08, "fault"),
        ];
        assert_eq!(names, expected);
    }

    #[test]
    fn enabling_and_disabling_never_reset_a_fault() {
        assert_eq!(State::Fault.towards_enabled(), None);
        assert!(
            ALL.iter()
                .filter_map(|state| state.towards_enabled())
                .all(|word| word & FAULT_RESET == 0)
        );
        assert!(
            ALL.iter()
                .filter_map(|state| state.towards_disabled())
                .all(|word| word & FAULT_RESET == 0)
        );
    }
}
