//! The program as it was built. A test of this package has `cargo test` build it, for the tests of the whole program, too.

use std::process::Command;

#[test]
fn the_version_is_that_of_the_package() {
    let run = Command::new(env!("CARGO_BIN_EXE_inplace"))
        .arg("--version")
        .output()
        .unwrap();
    let version = concat!("inplace ", env!("CARGO_PKG_VERSION"), "\n");
    assert_eq!(String::from_utf8_lossy(&run.stdout), version);
}
