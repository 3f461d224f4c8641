//! `cargo avr-bounds FILE.elf`: the same command, under the name that Cargo looks for.

fn main() -> std::process::ExitCode {
    avr_bounds::command::main()
}
