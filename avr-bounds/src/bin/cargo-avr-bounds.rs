//! `cargo avr-bounds FILE.elf`: the same command, as Cargo looks for it.

fn main() -> std::process::ExitCode {
    avr_bounds::command::main()
}
