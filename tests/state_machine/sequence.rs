//! Random sequences of requests, faults, signals, hanging supervisors and late ticks.
use proptest::prelude::*;

/// Something that fails in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    InvalidReading,
    Travel,
    FailedDrive,
    ReportsDisabled,
    RefusedCommand,
    RefusedEnable,
    PendingEnable,
    FailedEnable,
    RefusedReset,
    PendingReset,
    FailedReset,
}

const FAULTS: [Fault; 11] = [
    Fault::InvalidReading,
    Fault::Travel,
    Fault::FailedDrive,
    Fault::ReportsDisabled,
    Fault::RefusedCommand,
    Fault::RefusedEnable,
    Fault::PendingEnable,
    Fault::FailedEnable,
    Fault::RefusedReset,
    Fault::PendingReset,
    Fault::FailedReset,
];

/// The faults of a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Faults(u16);

impl Faults {
    pub fn has(self, fault: Fault) -> bool {
        self.0 & (1 << fault as u16) != 0
    }

    fn with(self, fault: Fault) -> Faults {
        Faults(self.0 | (1 << fault as u16))
    }
}

/// A program with a constant current.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    pub current_a: f64,
    pub ticks: u64,
    /// Whether it keeps its current in the first ramp, as a closed loop may.
    pub holds: bool,
}

/// A request.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    Arm,
    Start(Load),
    Finish,
    Stop,
    Clear,
    Tune,
}

/// What happens from a tick on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Happening {
    Order(Order),
    ArmAndStart(Load),
    /// A fault for a number of ticks.
    Fault(Fault, u64),
    Signal,
    /// The supervisor does not renew the lease for a number of ticks.
    Hang(u64),
    /// Missed ticks.
    Late(u32),
    /// The run is exchanged for another one.
    Exchange,
}

/// What the loop sees in a tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TickInputs {
    pub exchanges: bool,
    pub orders: Vec<Order>,
    pub signals: usize,
    pub renewed: bool,
    pub faults: Faults,
    pub missed: u32,
}

fn load() -> impl Strategy<Value = Load> {
    let current_a = prop_oneof![
        8 => -5.0..5.0f64,
        2 => Just(0.0),
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
        1 => Just(11.0),
    ];
    (current_a, 1..120u64, any::<bool>()).prop_map(|(current_a, ticks, holds)| Load {
        current_a,
        ticks,
        holds,
    })
}

fn happening() -> impl Strategy<Value = Happening> {
    let fault = (prop::sample::select(FAULTS.to_vec()), 1..8u64);
    prop_oneof![
        3 => Just(Happening::Order(Order::Arm)),
        3 => load().prop_map(|load| Happening::Order(Order::Start(load))),
        8 => load().prop_map(Happening::ArmAndStart),
        1 => Just(Happening::Order(Order::Finish)),
        1 => Just(Happening::Order(Order::Stop)),
        5 => Just(Happening::Order(Order::Clear)),
        1 => Just(Happening::Order(Order::Tune)),
        5 => fault.prop_map(|(fault, ticks)| Happening::Fault(fault, ticks)),
        1 => Just(Happening::Signal),
        1 => (1..100u64).prop_map(Happening::Hang),
        1 => (1..60u32).prop_map(Happening::Late),
        2 => Just(Happening::Exchange),
    ]
}

/// What happens in `ticks` ticks, about once in 12 ticks, in the order of time.
pub fn happenings(ticks: u64) -> impl Strategy<Value = Vec<(u64, Happening)>> {
    let most = (ticks / 6) as usize;
    prop::collection::vec((0..ticks, happening()), 0..=most).prop_map(|mut all| {
        all.sort_by_key(|(at, _)| *at);
        all
    })
}

/// The inputs of each tick.
pub struct Timeline<'a> {
    happenings: &'a [(u64, Happening)],
    faults: Vec<(u64, Fault)>,
    hangs_until: u64,
}

impl<'a> Timeline<'a> {
    pub fn new(happenings: &'a [(u64, Happening)]) -> Timeline<'a> {
        Timeline {
            happenings,
            faults: Vec::new(),
            hangs_until: 0,
        }
    }

    /// The inputs of `step`, counted without missed ticks. To be called for each step in turn.
    pub fn at(&mut self, step: u64) -> TickInputs {
        let mut inputs = TickInputs::default();
        let now = self.happenings.partition_point(|(at, _)| *at <= step);
        let (these, later) = self.happenings.split_at(now);
        self.happenings = later;
        for (_, happening) in these {
            self.happens(*happening, step, &mut inputs);
        }
        // The ring of requests has 16 slots, and there are four flags of signals.
        inputs.orders.truncate(16);
        inputs.signals = inputs.signals.min(4);
        self.faults.retain(|(until, _)| *until > step);
        let faults = self.faults.iter();
        inputs.faults = faults.fold(Faults::default(), |all, (_, fault)| all.with(*fault));
        inputs.renewed = step >= self.hangs_until;
        inputs
    }

    fn happens(&mut self, happening: Happening, step: u64, inputs: &mut TickInputs) {
        match happening {
            Happening::Order(order) => inputs.orders.push(order),
            Happening::ArmAndStart(load) => {
                inputs.orders.extend([Order::Arm, Order::Start(load)]);
            }
            Happening::Fault(fault, ticks) => self.faults.push((step + ticks, fault)),
            Happening::Signal => inputs.signals += 1,
            Happening::Hang(ticks) => self.hangs_until = self.hangs_until.max(step + ticks),
            Happening::Late(missed) => inputs.missed += missed,
            Happening::Exchange => inputs.exchanges = true,
        }
    }
}
