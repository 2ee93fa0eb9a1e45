//! The graph of imports between the files of a crate, read from the parsed source.
//!
//! A node is a file. A file points to the file in which a name that it uses is *defined*: re-exports (`pub use`) are
//! followed, and neither `mod` declarations nor re-exports are imports. A file's use of a `mod.rs` above it does not count
//! either: it defines the output and the options of the stage, which all its files use. Test modules do not count.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use syn::visit::{self, Visit};

/// The segments of a module's or an item's path from the crate's root.
pub(crate) type Segments = Vec<String>;

/// One source file of a crate.
pub(crate) struct SourceFile {
    pub(crate) path: PathBuf,
    pub(crate) module: Segments,
    pub(crate) syntax: syn::File,
}

/// All source files below `root`, which holds `lib.rs` or `main.rs`, in the order of their paths; test modules are left out.
pub(crate) fn source_files(root: &Path) -> Vec<SourceFile> {
    let mut paths = Vec::new();
    collect(root, &mut paths);
    paths.retain(|path| !is_test(path.strip_prefix(root).unwrap()));
    let parsed = |path: PathBuf| {
        let text = std::fs::read_to_string(&path).unwrap();
        let syntax = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let module = module_of(path.strip_prefix(root).unwrap());
        SourceFile { path, module, syntax }
    };
    paths.into_iter().map(parsed).collect()
}

/// Every file with the ending `rs` below a folder, in the order of the paths.
pub(crate) fn collect(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            collect(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// Whether a file or one of its folders is named as tests are: `tests`, `goal_tests.rs`.
pub(crate) fn is_test(within: &Path) -> bool {
    within.iter().any(|part| part.to_string_lossy().trim_end_matches(".rs").ends_with("tests"))
}

/// `physics/contact/mod.rs` and `physics/contact.rs` are both `[physics, contact]`; the root is empty.
fn module_of(within: &Path) -> Segments {
    let mut segments: Segments =
        within.with_extension("").iter().map(|part| part.to_string_lossy().into_owned()).collect();
    if matches!(segments.last().map(String::as_str), Some("mod" | "lib" | "main")) {
        segments.pop();
    }
    segments
}

/// What one file uses and what it re-exports, as paths from the crate's root.
#[derive(Default)]
struct Uses {
    /// The module that the visitor is in: that of the file, or an inline module of it.
    module: Segments,
    /// Names that `mod` declares in the file.
    children: BTreeSet<String>,
    used: Vec<Segments>,
    /// The name under which the file offers a path, and that path. `*` stands for everything in it.
    re_exported: Vec<(String, Segments)>,
}

impl Uses {
    /// The path from the crate's root, if the segments lead into the crate.
    fn rooted(&self, segments: &[String]) -> Option<Segments> {
        let mut base = match segments.first()?.as_str() {
            "crate" => Vec::new(),
            "self" | "super" => self.module.clone(),
            child if self.children.contains(child) => [self.module.as_slice(), &segments[..1]].concat(),
            _ => return None,
        };
        let mut rest = &segments[1..];
        if segments[0] == "super" {
            base.pop();
        }
        while rest.first().is_some_and(|segment| segment == "super") {
            base.pop();
            rest = &rest[1..];
        }
        base.extend_from_slice(rest);
        Some(base)
    }
}

/// The leaves of a `use` tree: the whole path, and the name that it gets.
fn leaves(tree: &syn::UseTree, prefix: &mut Segments, found: &mut Vec<(Segments, String)>) {
    match tree {
        syn::UseTree::Path(path) => {
            prefix.push(path.ident.to_string());
            leaves(&path.tree, prefix, found);
            prefix.pop();
        }
        syn::UseTree::Group(group) => {
            for item in &group.items {
                leaves(item, prefix, found);
            }
        }
        syn::UseTree::Glob(_) => found.push((prefix.clone(), "*".to_owned())),
        syn::UseTree::Name(name) if name.ident == "self" => {
            found.push((prefix.clone(), prefix.last().cloned().unwrap_or_default()));
        }
        syn::UseTree::Name(name) => {
            found.push(([prefix.as_slice(), &[name.ident.to_string()]].concat(), name.ident.to_string()));
        }
        syn::UseTree::Rename(rename) => {
            found
                .push(([prefix.as_slice(), &[rename.ident.to_string()]].concat(), rename.rename.to_string()));
        }
    }
}

/// Whether an item is compiled for tests alone.
pub(crate) fn is_test_item(attributes: &[syn::Attribute]) -> bool {
    let is_test = |attribute: &syn::Attribute| {
        attribute.path().is_ident("cfg")
            && attribute.meta.require_list().is_ok_and(|list| list.tokens.to_string() == "test")
    };
    attributes.iter().any(is_test)
}

impl<'ast> Visit<'ast> for Uses {
    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        let mut found = Vec::new();
        leaves(&item.tree, &mut Vec::new(), &mut found);
        for (segments, name) in found {
            let Some(path) = self.rooted(&segments) else { continue };
            if matches!(item.vis, syn::Visibility::Inherited) {
                self.used.push(path);
            } else {
                self.re_exported.push((name, path));
            }
        }
    }

    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        if item.content.is_some() && !is_test_item(&item.attrs) {
            self.module.push(item.ident.to_string());
            visit::visit_item_mod(self, item);
            self.module.pop();
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let segments: Segments = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        if segments.len() > 1 {
            self.used.extend(self.rooted(&segments));
        }
        visit::visit_path(self, path);
    }
}

/// What a file uses.
fn uses_of(file: &SourceFile) -> Uses {
    let declared = file.syntax.items.iter().filter_map(|item| match item {
        syn::Item::Mod(module) => Some(module.ident.to_string()),
        _ => None,
    });
    let mut uses = Uses { module: file.module.clone(), children: declared.collect(), ..Uses::default() };
    uses.visit_file(&file.syntax);
    uses
}

/// Every path into its own crate that a file names, re-exports included.
pub(crate) fn used_paths(file: &SourceFile) -> Vec<Segments> {
    let uses = uses_of(file);
    uses.used.into_iter().chain(uses.re_exported.into_iter().map(|(_, path)| path)).collect()
}

/// Which file uses which: indices into `files`.
pub(crate) fn imports(files: &[SourceFile]) -> Vec<BTreeSet<usize>> {
    let uses: Vec<Uses> = files.iter().map(uses_of).collect();
    let by_module: BTreeMap<&[String], usize> =
        files.iter().enumerate().map(|(index, file)| (file.module.as_slice(), index)).collect();
    let edges_of = |index: usize| {
        let defined = uses[index].used.iter().filter_map(|path| definition(path, &by_module, &uses, 0));
        let is_above = |target: usize| files[index].module.starts_with(&files[target].module);
        defined.filter(|target| !is_above(*target)).collect()
    };
    (0..files.len()).map(edges_of).collect()
}

/// The file in which a path is defined: the longest module on it, and from there along re-exports.
fn definition(
    path: &[String],
    by_module: &BTreeMap<&[String], usize>,
    uses: &[Uses],
    depth: usize,
) -> Option<usize> {
    const MOST_RE_EXPORTS: usize = 8;
    let (file, length) = (0..=path.len())
        .rev()
        .find_map(|length| by_module.get(&path[..length]).map(|file| (*file, length)))?;
    let Some(name) = path.get(length).filter(|_| depth < MOST_RE_EXPORTS) else { return Some(file) };
    for (offered, target) in &uses[file].re_exported {
        if offered == name {
            let whole = [target.as_slice(), &path[length + 1..]].concat();
            return definition(&whole, by_module, uses, depth + 1);
        }
    }
    Some(file)
}

/// The circles of a graph: its strongly connected components of more than one node (Tarjan, 1972).
pub(crate) fn circles(edges: &[BTreeSet<usize>]) -> Vec<Vec<usize>> {
    let mut search = Search { edges, ..Search::default() };
    search.found_at = vec![None; edges.len()];
    search.lowest = vec![0; edges.len()];
    search.is_on_stack = vec![false; edges.len()];
    for node in 0..edges.len() {
        if search.found_at[node].is_none() {
            search.visit(node);
        }
    }
    search.components.retain(|component| component.len() > 1);
    search.components
}

/// The state of Tarjan's search.
#[derive(Default)]
struct Search<'a> {
    edges: &'a [BTreeSet<usize>],
    found_at: Vec<Option<usize>>,
    lowest: Vec<usize>,
    is_on_stack: Vec<bool>,
    stack: Vec<usize>,
    count: usize,
    components: Vec<Vec<usize>>,
}

impl Search<'_> {
    fn visit(&mut self, node: usize) {
        let order = self.count;
        self.found_at[node] = Some(order);
        self.lowest[node] = order;
        self.count += 1;
        self.stack.push(node);
        self.is_on_stack[node] = true;
        for next in &self.edges[node] {
            match self.found_at[*next] {
                None => {
                    self.visit(*next);
                    self.lowest[node] = self.lowest[node].min(self.lowest[*next]);
                }
                Some(found_at) if self.is_on_stack[*next] => {
                    self.lowest[node] = self.lowest[node].min(found_at);
                }
                Some(_) => {}
            }
        }
        if self.lowest[node] == order {
            let first = self.stack.iter().position(|member| *member == node).unwrap();
            let component = self.stack.split_off(first);
            for member in &component {
                self.is_on_stack[*member] = false;
            }
            self.components.push(component);
        }
    }
}
