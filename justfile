# Commands for development; `just --list` shows them.

# Format, lints, documentation
check:
    cargo fmt --all --check
    cargo clippy --workspace --all-targets --all-features -- -D warnings
    RUSTDOCFLAGS='-D warnings' cargo doc --workspace --no-deps --document-private-items

# All tests but the statistical suite
test:
    cargo test

# Unit tests and examples of one crate of crates/, for example: just crate plant
crate name:
    cargo test -p bench-{{name}}

# Claims about many seeds: minutes of processor time
statistics:
    cargo test --features statistical --test statistical

# Benchmarks
bench:
    cargo bench

# The thesis figures, in target/figures
figures:
    cargo run --release -p thesis-figures -- --out target/figures

# Licences and advisories of all libraries (needs cargo-deny)
deny:
    cargo deny check

# Everything that decides whether a change is merged
ci:
    .ci/run
