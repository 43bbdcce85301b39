//! The program itself, stopped, killed and starved from outside.
mod command_line;
mod common;
mod disk;
mod kill;
mod replay;
mod stop;
