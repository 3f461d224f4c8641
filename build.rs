//! Passes memory.x to the linker, for the firmware only.

use std::env;

fn main() {
    println!("cargo::rerun-if-changed=memory.x");
    println!("cargo::rerun-if-changed=functions.x");
    println!("cargo::rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_ARCH").as_deref() == Ok("avr") {
        let root = env::var("CARGO_MANIFEST_DIR").expect("cargo names the package's directory");
        println!("cargo::rustc-link-arg-bins=-T{root}/memory.x");
        println!("cargo::rustc-link-arg-bins=-L{root}");
    }
}
