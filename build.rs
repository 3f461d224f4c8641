//! Passes memory.x to the linker, for the firmware only.

use std::{env, fs, path::Path};

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let out = env::var("OUT_DIR").expect("cargo names the folder for what a build script writes");
    // The linker reads copies: a folder that was cloned, built and deleted has the same build as this one, and would be named in it.
    for script in ["memory.x", "functions.x"] {
        println!("cargo::rerun-if-changed={script}");
        fs::copy(script, Path::new(&out).join(script)).expect("a linker script can be copied");
    }
    if env::var("CARGO_CFG_TARGET_ARCH").as_deref() == Ok("avr") {
        println!("cargo::rustc-link-arg-bins=-T{out}/memory.x");
        println!("cargo::rustc-link-arg-bins=-L{out}");
    }
}
