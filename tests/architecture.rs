//! The structure of the sources: no crate has cyclic imports between files. Cargo refuses cyclic dependencies between crates.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use syn::visit::{self, Visit};
use syn::{Attribute, Item, ItemMod, ItemUse, UseTree, Visibility};

/// The segments of a path from the root of the crate.
type ItemPath = Vec<String>;

/// One file of the library.
#[derive(Default)]
struct Module {
    file: PathBuf,
    /// Names that are defined here.
    defined: BTreeSet<String>,
    /// Names that are re-exported, with the paths of the original items.
    exported: BTreeMap<String, ItemPath>,
    /// Modules all of whose names are re-exported.
    globs: Vec<ItemPath>,
    /// All paths to which the code refers.
    uses: Vec<ItemPath>,
}

/// Visitor that collects re-exports and references of one file, without tests.
struct Reader {
    path: ItemPath,
    is_facade: bool,
    aliases: BTreeMap<String, ItemPath>,
    module: Module,
}

impl Reader {
    fn absolute(&self, segments: &[String]) -> Option<ItemPath> {
        let mut base = match segments.first()?.as_str() {
            "crate" => Vec::new(),
            "self" => self.path.clone(),
            "super" => self.path[..self.path.len().checked_sub(1)?].to_vec(),
            name => self.aliases.get(name)?.clone(),
        };
        for segment in &segments[1..] {
            match segment.as_str() {
                "super" => drop(base.pop()),
                "self" => {}
                name => base.push(name.to_string()),
            }
        }
        Some(base)
    }

    fn import(&mut self, tree: &UseTree, prefix: &[String], is_export: bool) {
        match tree {
            UseTree::Path(path) => {
                let mut longer = prefix.to_vec();
                longer.push(path.ident.to_string());
                self.import(&path.tree, &longer, is_export);
            }
            UseTree::Group(group) => {
                for tree in &group.items {
                    self.import(tree, prefix, is_export);
                }
            }
            UseTree::Name(name) => {
                let name = name.ident.to_string();
                self.name(prefix, &name, &name, is_export);
            }
            UseTree::Rename(rename) => {
                let (from, to) = (rename.ident.to_string(), rename.rename.to_string());
                self.name(prefix, &from, &to, is_export);
            }
            UseTree::Glob(_) => {
                if let Some(path) = self.local(prefix) {
                    if is_export {
                        self.module.globs.push(path);
                    } else {
                        self.module.uses.push(path);
                    }
                }
            }
        }
    }

    fn name(&mut self, prefix: &[String], from: &str, to: &str, is_export: bool) {
        let mut written = prefix.to_vec();
        if from != "self" {
            written.push(from.to_string());
        }
        let Some(path) = self.local(&written) else {
            return;
        };
        let to = if from == "self" {
            path.last().cloned().unwrap_or_default()
        } else {
            to.to_string()
        };
        if is_export {
            self.module.exported.insert(to.clone(), path.clone());
        } else {
            self.module.uses.push(path.clone());
        }
        self.aliases.insert(to, path);
    }

    /// The path from the root of this crate; `None` for other crates. The first segment may be a child module, as in `child::Item`.
    fn local(&self, written: &[String]) -> Option<ItemPath> {
        match written.first()?.as_str() {
            "crate" | "self" | "super" => self.absolute(written),
            first if self.module.defined.contains(first) => {
                let mut path = self.path.clone();
                path.extend_from_slice(written);
                Some(path)
            }
            _ => None,
        }
    }
}

fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg")
            && attribute
                .parse_args::<syn::Ident>()
                .is_ok_and(|word| word == "test")
    })
}

impl<'ast> Visit<'ast> for Reader {
    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        if !is_test(&item.attrs) {
            let is_export = self.is_facade && !matches!(item.vis, Visibility::Inherited);
            self.import(&item.tree, &[], is_export);
        }
    }

    fn visit_item_mod(&mut self, item: &'ast ItemMod) {
        if !is_test(&item.attrs) {
            visit::visit_item_mod(self, item);
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let segments: Vec<String> = path.segments.iter().map(|s| s.ident.to_string()).collect();
        if segments.len() > 1
            && let Some(path) = self.absolute(&segments)
        {
            self.module.uses.push(path);
        }
        visit::visit_path(self, path);
    }
}

fn name_of(item: &Item) -> Option<String> {
    let ident = match item {
        Item::Const(item) => &item.ident,
        Item::Enum(item) => &item.ident,
        Item::Fn(item) => &item.sig.ident,
        Item::Mod(item) => &item.ident,
        Item::Static(item) => &item.ident,
        Item::Struct(item) => &item.ident,
        Item::Trait(item) => &item.ident,
        Item::Type(item) => &item.ident,
        _ => return None,
    };
    Some(ident.to_string())
}

fn read(root: &Path, file: &Path) -> (ItemPath, Module) {
    let relative = file.strip_prefix(root).expect("below src");
    let mut path: ItemPath = relative
        .with_extension("")
        .iter()
        .map(|part| part.to_string_lossy().into_owned())
        .collect();
    let is_facade = matches!(path.last().map(String::as_str), Some("mod" | "lib"))
        || file.with_extension("").is_dir();
    if matches!(path.last().map(String::as_str), Some("mod" | "lib")) {
        path.pop();
    }
    let text = std::fs::read_to_string(file).expect("readable");
    let syntax = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let mut reader = Reader {
        path: path.clone(),
        is_facade,
        aliases: BTreeMap::new(),
        module: Module {
            file: relative.to_path_buf(),
            defined: syntax.items.iter().filter_map(name_of).collect(),
            ..Module::default()
        },
    };
    // Imports are read first, because a path may use a name that is imported further down.
    for item in &syntax.items {
        if let Item::Use(item) = item {
            reader.visit_item_use(item);
        }
    }
    for item in &syntax.items {
        if !matches!(item, Item::Use(_)) {
            reader.visit_item(item);
        }
    }
    (path, reader.module)
}

fn rust_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            rust_files(&path, files);
        } else if path.extension().is_some_and(|e| e == "rs")
            && !path.ends_with("main.rs")
            && !path.ends_with("tests.rs")
            && !path.components().any(|part| part.as_os_str() == "tests")
        {
            files.push(path);
        }
    }
}

/// The files of the library.
struct Library {
    modules: BTreeMap<ItemPath, Module>,
}

impl Library {
    fn read(sources: &str) -> Library {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join(sources);
        let mut files = Vec::new();
        rust_files(&root, &mut files);
        let modules = files.iter().map(|file| read(&root, file)).collect();
        Library { modules }
    }

    /// The module whose file defines the item of `path`; re-exports are followed.
    fn definition(&self, path: &[String]) -> Option<ItemPath> {
        let mut module: ItemPath = Vec::new();
        for (index, segment) in path.iter().enumerate() {
            let mut child = module.clone();
            child.push(segment.clone());
            if self.modules.contains_key(&child) {
                module = child;
                continue;
            }
            let here = self.modules.get(&module)?;
            if let Some(target) = here.exported.get(segment) {
                let mut longer = target.clone();
                longer.extend_from_slice(&path[index + 1..]);
                return self.definition(&longer);
            }
            if !here.defined.contains(segment) {
                return here
                    .globs
                    .iter()
                    .find_map(|glob| self.defines(glob, segment))
                    .or(Some(module));
            }
            return Some(module);
        }
        Some(module)
    }

    fn defines(&self, module: &[String], name: &str) -> Option<ItemPath> {
        self.modules
            .get(module)?
            .defined
            .contains(name)
            .then(|| module.to_vec())
    }

    /// The modules that each module imports, without itself.
    fn imports(&self) -> BTreeMap<&ItemPath, BTreeSet<ItemPath>> {
        self.modules
            .iter()
            .map(|(path, module)| {
                let mut targets: BTreeSet<ItemPath> = module
                    .uses
                    .iter()
                    .filter_map(|used| self.definition(used))
                    .collect();
                targets.remove(path);
                (path, targets)
            })
            .collect()
    }

    fn file(&self, module: &ItemPath) -> String {
        self.modules[module].file.display().to_string()
    }
}

type Graph = BTreeMap<ItemPath, BTreeSet<ItemPath>>;

/// All modules that `start` imports directly or indirectly.
fn reachable(graph: &Graph, start: &ItemPath) -> BTreeSet<ItemPath> {
    let mut found = BTreeSet::new();
    let mut waiting = vec![start];
    while let Some(module) = waiting.pop() {
        for target in graph.get(module).into_iter().flatten() {
            if found.insert(target.clone()) {
                waiting.push(target);
            }
        }
    }
    found
}

/// The sets of modules that import each other directly or indirectly.
fn cycles(graph: &Graph) -> BTreeSet<BTreeSet<ItemPath>> {
    let reached: Graph = graph
        .keys()
        .map(|module| (module.clone(), reachable(graph, module)))
        .collect();
    let in_cycle = reached
        .iter()
        .filter(|(module, targets)| targets.contains(*module));
    in_cycle
        .map(|(module, targets)| {
            let back = |target: &&ItemPath| reached[*target].contains(module);
            targets.iter().filter(back).cloned().collect()
        })
        .collect()
}

fn cycles_of_files(sources: &str) -> Vec<String> {
    let library = Library::read(sources);
    let imports = library.imports();
    let graph: Graph = imports
        .into_iter()
        .map(|(path, targets)| (path.clone(), targets))
        .collect();
    cycles(&graph)
        .iter()
        .map(|cycle| {
            let files: Vec<String> = cycle.iter().map(|path| library.file(path)).collect();
            files.join(", ")
        })
        .collect()
}

#[test]
fn program_has_no_cyclic_imports_between_files() {
    let found = cycles_of_files("src");
    assert!(found.is_empty(), "cyclic imports:\n{}", found.join("\n"));
}

#[test]
fn crates_have_no_cyclic_imports_between_files() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates");
    let entries: Vec<_> = std::fs::read_dir(crates).expect("a folder").collect();
    assert!(entries.len() >= 15, "{entries:?}");
    for entry in entries {
        let name = entry.expect("an entry").file_name();
        let found = cycles_of_files(&format!("crates/{}/src", name.display()));
        assert!(found.is_empty(), "cyclic imports:\n{}", found.join("\n"));
    }
}

#[test]
fn drivers_have_no_cyclic_imports_between_files() {
    let found = cycles_of_files("hal/src");
    assert!(found.is_empty(), "cyclic imports:\n{}", found.join("\n"));
}

/// Verifies that the tests above can fail.
#[test]
fn detects_a_cycle_of_three_files() {
    let name = |text: &str| vec![text.to_string()];
    let edges = [("a", "b"), ("b", "c"), ("c", "a"), ("d", "a"), ("c", "e")];
    let mut graph = Graph::new();
    for (from, to) in edges {
        graph.entry(name(from)).or_default().insert(name(to));
        graph.entry(name(to)).or_default();
    }
    let cycle = BTreeSet::from([name("a"), name("b"), name("c")]);
    assert_eq!(cycles(&graph), BTreeSet::from([cycle]));
}

#[test]
fn finds_the_imports_of_a_known_file() {
    let library = Library::read("crates/rt/src");
    let servo: ItemPath = ["servo"].map(String::from).into();
    let imports = library.imports();
    let files: Vec<String> = imports[&servo].iter().map(|to| library.file(to)).collect();
    assert!(files.contains(&"arming.rs".to_string()), "{files:?}");
    assert!(!files.contains(&"thread.rs".to_string()), "{files:?}");
}
