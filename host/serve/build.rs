//! Includes the page in the program, if `WEEDER_PAGE` names the page's folder. release.sh sets it. Other builds contain
//! no page.

use std::path::Path;
use std::{env, fs};

/// The page's files, in the order that `page.rs` expects.
const FILES: [&str; 3] = ["index.html", "page.css", "page.js"];

fn main() {
    println!("cargo:rerun-if-env-changed=WEEDER_PAGE");
    let folder = env::var("WEEDER_PAGE").ok();
    let inside = folder.map(|folder| {
        FILES.map(|name| {
            let path = Path::new(&folder).join(name);
            println!("cargo:rerun-if-changed={}", path.display());
            format!("include_bytes!({path:?})")
        })
    });
    let code = inside.map_or_else(|| "None".to_owned(), |files| format!("Some([{}])", files.join(", ")));
    let out = env::var("OUT_DIR").expect("cargo names it");
    fs::write(Path::new(&out).join("inside.rs"), code).expect("cargo has made the folder");
}
