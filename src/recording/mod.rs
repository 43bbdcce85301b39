//! Room: recording.
