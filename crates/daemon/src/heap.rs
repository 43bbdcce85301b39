//! The heap of the daemon. Its memory is locked, so what the allocator keeps of freed blocks remains resident.
//!
//! By default the allocator of the GNU C library gives each thread a heap of its own, which keeps the largest size that it ever had, and
//! raises the size from which on blocks are returned to the system when they are freed. Other C libraries are left as they are.

/// Gives all threads one heap, and returns large blocks to the system when they are freed. To be called before threads are started.
pub fn configure() {
    #[cfg(target_env = "gnu")]
    for warning in glibc::refusals(glibc::set) {
        tracing::warn!("{warning}");
    }
}

#[cfg(target_env = "gnu")]
mod glibc {
    use libc::c_int;

    /// Blocks from this size on are mappings of their own. It is the default, which is no longer raised once it is set.
    const MAPPED_BYTES: c_int = 128 << 10;

    /// A setting of `mallopt`.
    struct Setting {
        name: &'static str,
        parameter: c_int,
        value: c_int,
        /// What the daemon does without it.
        effect: &'static str,
        /// The environment variable for the same setting.
        variable: &'static str,
    }

    const SETTINGS: [Setting; 2] = [
        Setting {
            name: "M_ARENA_MAX",
            parameter: libc::M_ARENA_MAX,
            value: 1,
            effect: "each thread keeps the memory that its clients needed",
            variable: "MALLOC_ARENA_MAX",
        },
        Setting {
            name: "M_MMAP_THRESHOLD",
            parameter: libc::M_MMAP_THRESHOLD,
            value: MAPPED_BYTES,
            effect: "the daemon keeps the memory of large messages",
            variable: "MALLOC_MMAP_THRESHOLD_",
        },
    ];

    /// Applies all settings; returns a warning for each one that is refused.
    pub(super) fn refusals(set: impl Fn(c_int, c_int) -> bool) -> Vec<String> {
        let refused = SETTINGS
            .iter()
            .filter(|setting| !set(setting.parameter, setting.value));
        refused.map(Setting::refusal).collect()
    }

    impl Setting {
        fn refusal(&self) -> String {
            let Setting {
                name,
                value,
                effect,
                variable,
                ..
            } = self;
            format!(
                "the C library refuses {name} = {value}: {effect}; start the daemon with {variable}={value} in its environment"
            )
        }
    }

    /// Whether the allocator accepts a setting.
    #[allow(unsafe_code, reason = "mallopt has no safe wrapper")]
    pub(super) fn set(parameter: c_int, value: c_int) -> bool {
        // SAFETY: no pointer is passed; no other thread of the daemon has been started that could allocate at the same time.
        unsafe { libc::mallopt(parameter, value) != 0 }
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        #[test]
        fn refused_setting_is_named_with_its_effect_and_remedy() {
            assert_eq!(refusals(|_, _| true), Vec::<String>::new());
            let warnings = refusals(|parameter, _| parameter != libc::M_ARENA_MAX);
            let expected = "the C library refuses M_ARENA_MAX = 1: each thread keeps the memory that its clients needed; start the daemon with MALLOC_ARENA_MAX=1 in its environment";
            assert_eq!(warnings, [expected]);
        }
    }
}
