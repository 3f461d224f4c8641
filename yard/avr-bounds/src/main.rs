//! `avr-bounds FILE.elf`.

fn main() -> std::process::ExitCode {
    avr_bounds::command::main()
}
