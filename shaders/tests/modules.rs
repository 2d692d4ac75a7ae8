//! Every module parses, validates and stays inside WebGPU's default limits; every file belongs to a module.

use std::collections::{BTreeSet, HashSet};
use std::path::{Path, PathBuf};

use indirect_shaders::{MODULES, Module};
use naga::{AddressSpace, Handle, TypeInner};

fn parse(module: &Module) -> naga::Module {
    let source = module.source();
    naga::front::wgsl::parse_str(&source).unwrap_or_else(|e| {
        let place = e.location(&source).and_then(|l| module.locate(l.line_number as usize));
        panic!("{} at {place:?}: {}", module.name, e.emit_to_string(&source))
    })
}

#[test]
fn every_module_validates_without_optional_capabilities() {
    use naga::valid::{Capabilities, ValidationFlags, Validator};
    for module in MODULES {
        let ir = parse(module);
        let result = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&ir);
        if let Err(e) = result {
            let source = module.source();
            let place = e.location(&source).and_then(|l| module.locate(l.line_number as usize));
            panic!("{} at {place:?}: {}", module.name, e.emit_to_string(&source));
        }
        let found: BTreeSet<_> = ir.entry_points.iter().map(|e| e.name.as_str()).collect();
        let listed: BTreeSet<_> = module.entry_points.iter().copied().collect();
        assert_eq!(found, listed, "entry points of {}", module.name);
    }
}

#[test]
fn bindings_stay_inside_the_default_limits() {
    use naga::valid::{Capabilities, ValidationFlags, Validator};
    for module in MODULES {
        let ir = parse(module);
        let info = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&ir).unwrap();
        let mut bound = HashSet::new();
        for (_, variable) in ir.global_variables.iter() {
            if let Some(b) = variable.binding {
                assert!(b.group < 4, "{}: bind group {}", module.name, b.group);
                assert!(bound.insert((b.group, b.binding)), "{}: {b:?} is bound twice", module.name);
            }
        }
        for (i, entry) in ir.entry_points.iter().enumerate() {
            let used = |wanted: &dyn Fn(&naga::GlobalVariable) -> bool| {
                ir.global_variables
                    .iter()
                    .filter(|(h, v)| !info.get_entry_point(i)[*h].is_empty() && wanted(v))
                    .count()
            };
            let inner = |v: &naga::GlobalVariable| ir.types[v.ty].inner.clone();
            let at = format!("{}::{}", module.name, entry.name);
            let storage = used(&|v| matches!(v.space, AddressSpace::Storage { .. }));
            let uniform = used(&|v| v.space == AddressSpace::Uniform);
            let images = |writable| {
                used(&|v| match inner(v) {
                    TypeInner::Image { class, .. } => {
                        matches!(class, naga::ImageClass::Storage { .. }) == writable
                    }
                    _ => false,
                })
            };
            assert!(storage <= 8, "{at}: {storage} storage buffers, 8 are guaranteed");
            assert!(uniform <= 12, "{at}: {uniform} uniform buffers, 12 are guaranteed");
            assert!(images(false) <= 16, "{at}: more than 16 sampled textures");
            assert!(images(true) <= 4, "{at}: more than 4 storage textures");
            let [x, y, z] = entry.workgroup_size;
            assert!(x * y * z <= 256 && x <= 256 && y <= 256 && z <= 64, "{at}: workgroup {x}×{y}×{z}");
            let shared: u32 = ir
                .global_variables
                .iter()
                .filter(|(h, v)| {
                    v.space == AddressSpace::WorkGroup && !info.get_entry_point(i)[*h].is_empty()
                })
                .map(|(_, v)| size(&ir, v.ty))
                .sum();
            assert!(shared <= 16384, "{at}: {shared} bytes of workgroup memory, 16384 are guaranteed");
        }
    }
}

fn size(ir: &naga::Module, ty: Handle<naga::Type>) -> u32 {
    ir.types[ty].inner.size(ir.to_ctx())
}

#[test]
fn every_file_belongs_to_a_module() {
    fn walk(dir: &Path, found: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(dir).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, found);
            } else {
                found.push(path);
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("wgsl");
    let mut found = Vec::new();
    walk(&root, &mut found);
    assert!(!found.is_empty());
    let listed: HashSet<_> = MODULES.iter().flat_map(|m| m.files).map(|(path, _)| *path).collect();
    for path in found {
        let name = path.strip_prefix(&root).unwrap().to_str().unwrap().replace('\\', "/");
        assert!(listed.contains(name.as_str()), "{name} belongs to no module");
    }
}

#[test]
fn lines_lead_back_to_their_files() {
    let module = Module {
        name: "two",
        files: &[("a.wgsl", "// one\n// two\n"), ("b.wgsl", "// three\n// four")],
        entry_points: &[],
    };
    assert_eq!(module.source().lines().count(), 4);
    let places: Vec<_> = (0..6).map(|line| module.locate(line)).collect();
    let (a, b) = ("a.wgsl", "b.wgsl");
    assert_eq!(places, [None, Some((a, 1)), Some((a, 2)), Some((b, 1)), Some((b, 2)), None]);
}
