//! The count of a probe wraps without a trip, and without a reading that is taken for an old one.
use bench_hal::{Devices, DisplacementProbe, Reading, Tick};
use bench_rt::arming::State;
use bench_rt::servo::Request;

use crate::safety::rig::{Bench, StillRig, endless, stage};

/// A probe that counts from `first`, with as many bits as `mask` has.
struct Counting {
    still: StillRig,
    first: u64,
    mask: u64,
}

impl DisplacementProbe for Counting {
    fn latest(&mut self, now: Tick) -> Reading {
        let reading = self.still.latest(now);
        Reading {
            sequence: self.first.wrapping_add(reading.sequence) & self.mask,
            ..reading
        }
    }
}

#[test]
fn count_of_a_probe_wraps_without_a_trip() {
    for mask in [u64::from(u16::MAX), u64::from(u32::MAX), u64::MAX] {
        let rig = Devices {
            amplifier: StillRig::default(),
            probe: Counting {
                still: StillRig::default(),
                first: mask - 500,
                mask,
            },
        };
        let mut bench = Bench::around(&stage(), rig);
        bench.request(Request::Arm);
        bench.request(Request::Start(endless(|tick| 0.1 * (tick % 2) as f64)));
        bench.run(1000);
        // The first reading has the number mask - 499: 500 readings before the wrap, 500 after it.
        assert_eq!(bench.ticks().at(499).probe_sequence, mask);
        assert_eq!(bench.ticks().at(999).probe_sequence, 499);
        assert_eq!((bench.trips(), bench.state()), (Vec::new(), State::Running));
    }
}
