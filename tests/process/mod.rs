//! The program as a process: stopped by signals, killed, and without disk space.
mod command_line;
mod common;
mod disk;
mod kill;
mod recover;
mod remedies;
mod replay;
mod stop;
mod undecided;
