//! The modules of one crate, the names that they define and import, and which file uses a name of which.
//!
//! Names are followed through imports and re-exports to the file that defines them. That is done without types, so a method
//! that is called on anything but `self` is not seen; whoever calls it nearly always names its type as well. Tests
//! (`#[cfg(test)]`) do not count.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use proc_macro2::{TokenStream, TokenTree};
use syn::punctuated::Punctuated;
use syn::visit::{self, Visit};
use syn::{Attribute, Item, Meta, Token, UseTree};

/// Which file uses which, and one name for which it does, of those it uses.
pub(super) type Uses = BTreeMap<PathBuf, BTreeMap<PathBuf, String>>;

/// What each file of the crate whose root is the file `root` uses of the others; every file is listed. `read` gives the text
/// of a file, or `None` where there is no such file.
pub(super) fn uses(root: &Path, read: impl Fn(&Path) -> Option<String>) -> Result<Uses, String> {
    let mut tree = Tree { read, modules: Vec::new(), methods: BTreeMap::new() };
    let text = (tree.read)(root).ok_or_else(|| format!("{}: no such file", root.display()))?;
    let folder = root.parent().unwrap_or(Path::new("")).to_owned();
    tree.add(None, root, &folder, parse(root, &text)?)?;
    tree.find_methods();
    let mut uses = Uses::new();
    for (at, module) in tree.modules.iter().enumerate() {
        uses.entry(module.file.clone()).or_default();
        let mut found = References {
            tree: &tree,
            module: at,
            implemented: None,
            locals: BTreeSet::new(),
            uses: &mut uses,
        };
        module.items.iter().for_each(|item| found.visit_item(item));
    }
    Ok(uses)
}

fn parse(file: &Path, text: &str) -> Result<Vec<Item>, String> {
    syn::parse_file(text).map(|f| f.items).map_err(|e| format!("{}: {e}", file.display()))
}

/// A module, in a file of its own or not.
struct Module {
    file: PathBuf,
    parent: Option<usize>,
    children: BTreeMap<String, usize>,
    /// Without modules and what is for tests only.
    items: Vec<Item>,
    /// Names of what it defines, modules aside.
    defined: BTreeSet<String>,
    imports: Vec<Import>,
}

/// A leaf of a `use`; `name` is `None` for `*`.
struct Import {
    name: Option<String>,
    path: Vec<String>,
}

/// What a path names.
#[derive(Debug, Clone)]
enum Target {
    Module(usize),
    /// An item, and what follows its name in the path: an associated function or a variant.
    Item {
        module: usize,
        name: String,
        member: Option<String>,
    },
}

struct Tree<R> {
    read: R,
    modules: Vec<Module>,
    /// The modules with an `impl Type` that defines a method, by module and name of the type, and name of the method.
    methods: BTreeMap<(usize, String, String), BTreeSet<usize>>,
}

impl<R: Fn(&Path) -> Option<String>> Tree<R> {
    /// `folder` is where the files of child modules lie.
    fn add(
        &mut self,
        parent: Option<usize>,
        file: &Path,
        folder: &Path,
        items: Vec<Item>,
    ) -> Result<usize, String> {
        let items: Vec<Item> = items.into_iter().filter(|item| !for_tests(attributes(item))).collect();
        let mut imports = Imports(Vec::new());
        items.iter().for_each(|item| imports.visit_item(item));
        let at = self.modules.len();
        self.modules.push(Module {
            file: file.to_owned(),
            parent,
            children: BTreeMap::new(),
            defined: items.iter().filter_map(name).collect(),
            items: Vec::new(),
            imports: imports.0,
        });
        for item in items {
            let Item::Mod(child) = item else {
                self.modules[at].items.push(item);
                continue;
            };
            let name = child.ident.to_string();
            let within = folder.join(&name);
            let added = if let Some((_, content)) = child.content {
                self.add(Some(at), file, &within, content)?
            } else {
                let mut candidates = vec![folder.join(format!("{name}.rs")), within.join("mod.rs")];
                if let Some(path) = path_attribute(&child.attrs) {
                    candidates = vec![joined(file.parent().unwrap_or(file), &path)];
                }
                let read = candidates.iter().find_map(|f| Some((f, (self.read)(f)?)));
                let (file, text) =
                    read.ok_or_else(|| format!("{}: no file for `mod {name}`", file.display()))?;
                self.add(Some(at), file, &within, parse(file, &text)?)?
            };
            self.modules[at].children.insert(name, added);
        }
        Ok(at)
    }
}

impl<R> Tree<R> {
    fn find_methods(&mut self) {
        let mut methods: BTreeMap<_, BTreeSet<usize>> = BTreeMap::new();
        for (at, module) in self.modules.iter().enumerate() {
            for item in &module.items {
                let Item::Impl(block) = item else { continue };
                let Some((owner, name)) = self.implemented(at, block) else { continue };
                let functions = block.items.iter().filter_map(|i| match i {
                    syn::ImplItem::Fn(f) if block.trait_.is_none() => Some(f.sig.ident.to_string()),
                    _ => None,
                });
                for function in functions {
                    methods.entry((owner, name.clone(), function)).or_default().insert(at);
                }
            }
        }
        self.methods = methods;
    }

    /// The module and name of the type that a block is for, where it is one of this crate.
    fn implemented(&self, at: usize, block: &syn::ItemImpl) -> Option<(usize, String)> {
        let syn::Type::Path(ty) = &*block.self_ty else { return None };
        match self.resolve(at, &segments(&ty.path), &mut Vec::new())? {
            Target::Item { module, name, .. } => Some((module, name)),
            Target::Module(_) => None,
        }
    }

    /// What a path names that stands in module `from`; `None` for names of other crates and for local ones. `pending`: imports
    /// that are being followed.
    fn resolve(&self, from: usize, path: &[String], pending: &mut Vec<(usize, String)>) -> Option<Target> {
        let mut at = from;
        for (i, segment) in path.iter().enumerate() {
            match segment.as_str() {
                "crate" => at = 0,
                "self" => {}
                "super" => at = self.modules[at].parent?,
                name => {
                    let next = path.get(i + 1);
                    match self.lookup(at, name, next.is_some(), pending)? {
                        Target::Module(module) => at = module,
                        Target::Item { module, name, member } => {
                            return Some(Target::Item { module, name, member: member.or(next.cloned()) });
                        }
                    }
                }
            }
        }
        Some(Target::Module(at))
    }

    /// What a name means in a module. A name may stand for a module and for a function: the module is meant where the path goes
    /// on.
    fn lookup(
        &self,
        at: usize,
        name: &str,
        goes_on: bool,
        pending: &mut Vec<(usize, String)>,
    ) -> Option<Target> {
        let module = &self.modules[at];
        let child = module.children.get(name).map(|&child| Target::Module(child));
        if goes_on && child.is_some() {
            return child;
        }
        let defined = || module.defined.contains(name);
        let item = || Target::Item { module: at, name: name.to_owned(), member: None };
        if !goes_on && defined() {
            return Some(item());
        }
        let key = (at, name.to_owned());
        let mut imported = None;
        if !pending.contains(&key) {
            pending.push(key);
            // Names before globs, which they shadow.
            let named = module.imports.iter().filter(|i| i.name.as_deref() == Some(name));
            let mut found: Vec<Target> = named.filter_map(|i| self.resolve(at, &i.path, pending)).collect();
            if found.is_empty() {
                let globs = module.imports.iter().filter(|i| i.name.is_none());
                found.extend(globs.filter_map(|i| match self.resolve(at, &i.path, pending)? {
                    Target::Module(module) => self.lookup(module, name, goes_on, pending),
                    Target::Item { .. } => None,
                }));
            }
            pending.pop();
            let wanted = found.iter().find(|t| matches!(t, Target::Module(_)) == goes_on);
            imported = wanted.or(found.first()).cloned();
        }
        imported.or_else(|| defined().then(item)).or(child)
    }

    fn is_within(&self, module: usize, ancestor: usize) -> bool {
        module == ancestor || self.modules[module].parent.is_some_and(|p| self.is_within(p, ancestor))
    }
}

/// Collects the imports of one module, those inside functions among them.
struct Imports(Vec<Import>);

impl Imports {
    fn flatten(&mut self, tree: &UseTree, path: &mut Vec<String>) {
        match tree {
            UseTree::Path(p) => {
                path.push(p.ident.to_string());
                self.flatten(&p.tree, path);
                path.pop();
            }
            UseTree::Group(group) => group.items.iter().for_each(|tree| self.flatten(tree, path)),
            UseTree::Glob(_) => self.0.push(Import { name: None, path: path.clone() }),
            UseTree::Name(n) if n.ident == "self" => {
                self.0.push(Import { name: path.last().cloned(), path: path.clone() });
            }
            UseTree::Name(n) => self.leaf(path, &n.ident, &n.ident),
            UseTree::Rename(r) if r.ident == "self" => {
                self.0.push(Import { name: Some(r.rename.to_string()), path: path.clone() });
            }
            UseTree::Rename(r) => self.leaf(path, &r.ident, &r.rename),
        }
    }

    fn leaf(&mut self, path: &[String], ident: &syn::Ident, name: &syn::Ident) {
        let path = path.iter().cloned().chain([ident.to_string()]).collect();
        self.0.push(Import { name: Some(name.to_string()), path });
    }
}

impl<'ast> Visit<'ast> for Imports {
    fn visit_item_mod(&mut self, _: &'ast syn::ItemMod) {}

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        // `::name` is a crate.
        if item.leading_colon.is_none() {
            self.flatten(&item.tree, &mut Vec::new());
        }
    }
}

/// Collects what one module uses.
struct References<'a, R> {
    tree: &'a Tree<R>,
    module: usize,
    /// The type of the block around.
    implemented: Option<(usize, String)>,
    /// Variables of the function around.
    locals: BTreeSet<String>,
    uses: &'a mut Uses,
}

impl<R> References<'_, R> {
    fn file(&self, module: usize) -> &Path {
        &self.tree.modules[module].file
    }

    fn uses(&mut self, module: usize, name: &str) {
        let (from, to) = (self.file(self.module).to_owned(), self.file(module).to_owned());
        if from != to {
            self.uses.entry(from).or_default().entry(to).or_insert_with(|| name.to_owned());
        }
    }

    /// What code says in so many words.
    fn mention(&mut self, path: &[String]) {
        match path {
            [ty, member, ..] if ty == "Self" => self.method(member),
            [name] if self.locals.contains(name) => {}
            _ => {
                if let Some(Target::Item { module, name, member }) =
                    self.tree.resolve(self.module, path, &mut Vec::new())
                {
                    self.uses(module, &name);
                    if let Some(member) = member {
                        self.member(module, name, member);
                    }
                }
            }
        }
    }

    /// A method of the type of the block around.
    fn method(&mut self, method: &str) {
        if let Some((module, name)) = self.implemented.clone() {
            self.member(module, name, method.to_owned());
        }
    }

    fn member(&mut self, module: usize, ty: String, method: String) {
        let name = format!("{ty}::{method}");
        for &definer in self.tree.methods.get(&(module, ty, method)).into_iter().flatten() {
            self.uses(definer, &name);
        }
    }

    /// The paths within a macro, whose syntax is its own.
    fn tokens(&mut self, tokens: TokenStream) {
        let tokens: Vec<_> = tokens.into_iter().collect();
        let is = |i: usize, c: char| matches!(tokens.get(i), Some(TokenTree::Punct(p)) if p.as_char() == c);
        let mut i = 0;
        while i < tokens.len() {
            match &tokens[i] {
                TokenTree::Group(group) => self.tokens(group.stream()),
                TokenTree::Ident(first) => {
                    // A field or method, or a name of a crate.
                    let other = i > 0 && (is(i - 1, '.') || is(i - 1, ':') && i > 1 && is(i - 2, ':'));
                    let mut path = vec![first.to_string()];
                    while is(i + 1, ':') && is(i + 2, ':') {
                        let Some(TokenTree::Ident(next)) = tokens.get(i + 3) else { break };
                        path.push(next.to_string());
                        i += 3;
                    }
                    if !other {
                        self.mention(&path);
                    }
                }
                TokenTree::Punct(_) | TokenTree::Literal(_) => {}
            }
            i += 1;
        }
    }

    /// Looks into a function, whose variables hide what they share a name with.
    fn function(&mut self, locals: Locals, look: impl FnOnce(&mut Self)) {
        let outside = std::mem::replace(&mut self.locals, locals.0);
        look(self);
        self.locals = outside;
    }
}

impl<'ast, R> Visit<'ast> for References<'_, R> {
    fn visit_item_mod(&mut self, _: &'ast syn::ItemMod) {}
    fn visit_visibility(&mut self, _: &'ast syn::Visibility) {}
    fn visit_attribute(&mut self, _: &'ast Attribute) {}

    /// An import from below is a re-export, or else what imports it also mentions it.
    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        let mut imports = Imports(Vec::new());
        imports.visit_item_use(item);
        for import in imports.0.iter().filter(|i| i.name.is_some()) {
            if let Some(Target::Item { module, name, .. }) =
                self.tree.resolve(self.module, &import.path, &mut Vec::new())
                && !self.tree.is_within(module, self.module)
            {
                self.uses(module, &name);
            }
        }
    }

    fn visit_item_impl(&mut self, block: &'ast syn::ItemImpl) {
        let around = self.implemented.take();
        self.implemented = self.tree.implemented(self.module, block);
        visit::visit_item_impl(self, block);
        self.implemented = around;
    }

    fn visit_item_fn(&mut self, f: &'ast syn::ItemFn) {
        let mut locals = Locals::default();
        locals.visit_item_fn(f);
        self.function(locals, |s| visit::visit_item_fn(s, f));
    }

    fn visit_impl_item_fn(&mut self, f: &'ast syn::ImplItemFn) {
        if for_tests(&f.attrs) {
            return;
        }
        let mut locals = Locals::default();
        locals.visit_impl_item_fn(f);
        self.function(locals, |s| visit::visit_impl_item_fn(s, f));
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        if path.leading_colon.is_none() {
            self.mention(&segments(path));
        }
        visit::visit_path(self, path);
    }

    fn visit_expr_method_call(&mut self, call: &'ast syn::ExprMethodCall) {
        if matches!(&*call.receiver, syn::Expr::Path(p) if p.path.is_ident("self")) {
            self.method(&call.method.to_string());
        }
        visit::visit_expr_method_call(self, call);
    }

    fn visit_macro(&mut self, mac: &'ast syn::Macro) {
        self.visit_path(&mac.path);
        self.tokens(mac.tokens.clone());
    }
}

/// The variables of a function. Names in capitals in a pattern are constants.
#[derive(Default)]
struct Locals(BTreeSet<String>);

impl<'ast> Visit<'ast> for Locals {
    fn visit_pat_ident(&mut self, pattern: &'ast syn::PatIdent) {
        let name = pattern.ident.to_string();
        if name.starts_with(|c: char| c.is_lowercase() || c == '_') {
            self.0.insert(name);
        }
        visit::visit_pat_ident(self, pattern);
    }
}

fn segments(path: &syn::Path) -> Vec<String> {
    path.segments.iter().map(|s| s.ident.to_string()).collect()
}

/// The name that an item brings into its module, other than that of a module.
fn name(item: &Item) -> Option<String> {
    let ident = match item {
        Item::Const(i) => &i.ident,
        Item::Enum(i) => &i.ident,
        Item::Fn(i) => &i.sig.ident,
        Item::Macro(i) => i.ident.as_ref()?,
        Item::Static(i) => &i.ident,
        Item::Struct(i) => &i.ident,
        Item::Trait(i) => &i.ident,
        Item::TraitAlias(i) => &i.ident,
        Item::Type(i) => &i.ident,
        Item::Union(i) => &i.ident,
        _ => return None,
    };
    Some(ident.to_string())
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(i) => &i.attrs,
        Item::Enum(i) => &i.attrs,
        Item::Fn(i) => &i.attrs,
        Item::Impl(i) => &i.attrs,
        Item::Macro(i) => &i.attrs,
        Item::Mod(i) => &i.attrs,
        Item::Static(i) => &i.attrs,
        Item::Struct(i) => &i.attrs,
        Item::Trait(i) => &i.attrs,
        Item::Type(i) => &i.attrs,
        Item::Union(i) => &i.attrs,
        Item::Use(i) => &i.attrs,
        _ => &[],
    }
}

/// Whether only tests have it: `#[cfg(test)]`, or `test` among what `all` names.
/// The value of `#[path = "…"]`.
fn path_attribute(attributes: &[Attribute]) -> Option<String> {
    attributes.iter().find_map(|a| match &a.meta {
        Meta::NameValue(pair) if pair.path.is_ident("path") => match &pair.value {
            syn::Expr::Lit(syn::ExprLit { lit: syn::Lit::Str(text), .. }) => Some(text.value()),
            _ => None,
        },
        _ => None,
    })
}

/// `path`, which may begin with `..`, below `folder`.
fn joined(folder: &Path, path: &str) -> PathBuf {
    let mut out = folder.to_owned();
    for part in path.split('/') {
        if part == ".." {
            out.pop();
        } else {
            out.push(part);
        }
    }
    out
}

fn for_tests(attributes: &[Attribute]) -> bool {
    fn needs_test(condition: &Meta) -> bool {
        match condition {
            Meta::Path(path) => path.is_ident("test"),
            Meta::List(list) if list.path.is_ident("all") => list
                .parse_args_with(Punctuated::<Meta, Token![,]>::parse_terminated)
                .is_ok_and(|all| all.iter().any(needs_test)),
            _ => false,
        }
    }
    attributes.iter().any(|a| a.path().is_ident("cfg") && a.parse_args().is_ok_and(|c: Meta| needs_test(&c)))
}
