//! `inplace manual`: what the command line offers, for `man` and for shells.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use clap::CommandFactory;
use clap_complete::{Shell, generate_to};

use super::Failure;
use crate::arguments::Arguments;

/// Writes the manual pages and the completions to where `man` and the shells look for them below `share`.
pub fn run(share: &Path) -> Result<(), Failure> {
    write(share).map_err(|error| format!("{}: the manual cannot be written: {error}", share.display()).into())
}

fn write(share: &Path) -> io::Result<()> {
    let folder = |name: &str| -> io::Result<PathBuf> {
        let path = share.join(name);
        fs::create_dir_all(&path)?;
        Ok(path)
    };
    let mut command = Arguments::command();
    clap_mangen::generate_to(command.clone(), folder("man/man1")?)?;
    for (shell, completions) in [
        (Shell::Bash, "bash-completion/completions"),
        (Shell::Fish, "fish/vendor_completions.d"),
        (Shell::Zsh, "zsh/site-functions"),
    ] {
        generate_to(shell, &mut command, "inplace", folder(completions)?)?;
    }
    Ok(())
}
