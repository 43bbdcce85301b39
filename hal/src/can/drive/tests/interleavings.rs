//! All interleavings of the tick and the threads of the driver, by `loom` (see `atomics.rs`).
use std::sync::Arc;

use loom::thread;

use super::super::super::last_pass::PASS_TIMEOUT;
use super::super::faults::{DRIVE_FAULT, EMERGENCY, STATUS_LOST};
use super::super::shared::{Intent, Shared};

const EMERGENCY_CODE: u32 = EMERGENCY + 0x3210;

/// The fault after the tick and the service have latched one each.
fn latched_by_both(by_tick: u32, by_service: u32) -> u32 {
    let shared = Arc::new(Shared::default());
    let service = {
        let shared = Arc::clone(&shared);
        thread::spawn(move || shared.latch(by_service))
    };
    shared.latch(by_tick);
    service.join().unwrap();
    shared.fault()
}

#[test]
fn one_of_two_faults_is_kept() {
    loom::model(|| {
        let fault = latched_by_both(STATUS_LOST, DRIVE_FAULT);
        assert!([STATUS_LOST, DRIVE_FAULT].contains(&fault), "{fault:#x}");
    });
}

#[test]
fn the_more_precise_of_two_faults_is_kept() {
    loom::model(|| {
        assert_eq!(latched_by_both(DRIVE_FAULT, EMERGENCY_CODE), EMERGENCY_CODE);
    });
    loom::model(|| {
        assert_eq!(latched_by_both(EMERGENCY_CODE, DRIVE_FAULT), EMERGENCY_CODE);
    });
}

/// The reset thread ends a reset while the caller already enables or disables the drive.
#[test]
fn the_end_of_a_reset_does_not_replace_a_newer_intent() {
    for newer in [Intent::Enabling, Intent::On, Intent::Off] {
        loom::model(move || {
            let shared = Arc::new(Shared::default());
            shared.request_reset();
            let reset = {
                let shared = Arc::clone(&shared);
                thread::spawn(move || shared.end_reset())
            };
            shared.set_intent(newer);
            reset.join().unwrap();
            assert_eq!(shared.intent(), newer);
        });
    }
}

/// The service sees every use, also one that ends before its next pass.
#[test]
fn a_short_use_is_counted_before_its_end_is_seen() {
    loom::model(|| {
        let shared = Arc::new(Shared::default());
        let caller = {
            let shared = Arc::clone(&shared);
            thread::spawn(move || {
                shared.set_intent(Intent::Enabling);
                shared.request_reset();
            })
        };
        if shared.resets() > 0 {
            assert_eq!(shared.uses(), 1);
        }
        caller.join().unwrap();
        assert_eq!((shared.uses(), shared.resets()), (1, 1));
    });
}

/// Whoever sees the count of a status frame sees its contents, or newer ones.
#[test]
fn the_count_of_a_status_frame_follows_its_contents() {
    loom::model(|| {
        let shared = Arc::new(Shared::default());
        let service = {
            let shared = Arc::clone(&shared);
            thread::spawn(move || {
                for count in 1..=2u16 {
                    shared.set_status(count, count as i16);
                }
            })
        };
        let count = shared.status_count();
        let (word, actual) = (shared.statusword(), shared.actual());
        if count > 0 {
            assert!(
                word.is_some_and(|word| u32::from(word) >= count),
                "{word:?}"
            );
            assert!(
                actual.is_some_and(|actual| actual as u32 >= count),
                "{actual:?}"
            );
        }
        service.join().unwrap();
    });
}

/// A pass that the tick sees as recent has written its state before.
#[test]
fn a_recent_pass_follows_the_state_that_it_wrote() {
    loom::model(|| {
        let shared = Arc::new(Shared::default());
        let service = {
            let shared = Arc::clone(&shared);
            thread::spawn(move || {
                shared.latch(STATUS_LOST);
                shared.last_pass.set(1_000_000_000);
            })
        };
        if !shared.last_pass.is_overdue(1_000_000_000, PASS_TIMEOUT) {
            assert_eq!(shared.fault(), STATUS_LOST);
        }
        service.join().unwrap();
    });
}
