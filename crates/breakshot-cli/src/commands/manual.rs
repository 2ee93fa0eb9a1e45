//! `breakshot manual`: man pages and shell completions, from the definitions of the flags themselves.

use crate::Outcome;
use crate::args::{Arguments, ManualArgs};
use breakshot::{Error, Result, files};
use clap::{CommandFactory, ValueEnum};
use clap_complete::{Generator, Shell};
use clap_mangen::Man;
use std::path::Path;

/// Writes one man page for the program and for each of its commands, and one file of completions for each shell.
pub(crate) fn run(args: &ManualArgs) -> Result<Outcome> {
    let mut program = Arguments::command();
    program.build();
    let pages = args.folder.join("man/man1");
    write(&pages, "breakshot.1", &page(program.clone()))?;
    for command in program.get_subcommands().filter(|command| !command.is_hide_set()) {
        let name = format!("breakshot-{}", command.get_name());
        write(&pages, &format!("{name}.1"), &page(command.clone().display_name(name)))?;
    }
    let completions = args.folder.join("completions");
    for shell in Shell::value_variants() {
        let mut script = Vec::new();
        clap_complete::generate(*shell, &mut Arguments::command(), "breakshot", &mut script);
        write(&completions, &shell.file_name("breakshot"), &script)?;
    }
    println!("Wrote {} and {}", pages.display(), completions.display());
    Ok(Outcome::Done)
}

/// A man page (roff).
fn page(command: clap::Command) -> Vec<u8> {
    let mut page = Vec::new();
    // Writing to memory does not fail.
    let _ = Man::new(command).render(&mut page);
    page
}

fn write(folder: &Path, name: &str, bytes: &[u8]) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.into(), source })?;
    files::write_whole(&folder.join(name), bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_has_a_page_with_its_flags_and_every_shell_its_completions() {
        let folder = tempfile::tempdir().expect("a folder");
        run(&ManualArgs { folder: folder.path().into() }).expect("written");
        let text = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect(name);
        assert!(text("man/man1/breakshot.1").contains("breakshot\\-plan(1)"));
        let plan = text("man/man1/breakshot-plan.1");
        assert!(plan.contains("\\-\\-properties") && plan.contains("breakshot\\-plan"), "{plan}");
        for command in Arguments::command().get_subcommands() {
            assert!(text(&format!("man/man1/breakshot-{}.1", command.get_name())).starts_with(".ie"));
        }
        for name in ["breakshot.bash", "_breakshot", "breakshot.fish", "breakshot.elv", "_breakshot.ps1"] {
            assert!(text(&format!("completions/{name}")).contains("properties"), "{name}");
        }
    }
}
