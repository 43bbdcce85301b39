//! The program itself, stopped, killed and starved from outside.
mod common;
mod disk;
mod kill;
mod replay;
mod stop;
