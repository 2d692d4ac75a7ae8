//! `src/bindings.rs` is what naga reflects; `INDIRECT_BLESS=1` writes it.

use std::fmt::Write;
use std::path::Path;

use indirect_shaders::MODULES;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{AddressSpace, ImageClass, ScalarKind, StorageAccess, TypeInner};

#[test]
fn the_table_of_bindings_is_that_of_the_sources() {
    let mut text = String::from(
        "//! What each entry point binds. Written by the test `bindings`, see the crate's page.\n\n\
         use crate::entry_point::BindingKind::{Read, ReadWrite, StorageTexture, TextureFloat, TextureUint, Uniform};\n\
         use crate::entry_point::{Binding, BindingKind, EntryPoint};\n\n\
         const fn at(group: u32, binding: u32, name: &'static str, kind: BindingKind) -> Binding {\n    \
         Binding { group, binding, name, kind }\n}\n\n\
         #[rustfmt::skip]\npub(crate) const ENTRY_POINTS: &[EntryPoint] = &[\n",
    );
    for module in MODULES {
        let source = module.source();
        let ir = naga::front::wgsl::parse_str(&source).unwrap();
        let info = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&ir).unwrap();
        for (i, entry) in ir.entry_points.iter().enumerate() {
            let mut bound: Vec<_> = ir
                .global_variables
                .iter()
                .filter(|(h, _)| !info.get_entry_point(i)[*h].is_empty())
                .filter_map(|(_, v)| {
                    let kind = match (v.space, &ir.types[v.ty].inner) {
                        (AddressSpace::Uniform, _) => "Uniform",
                        (AddressSpace::Storage { access }, _) if access.contains(StorageAccess::STORE) => {
                            "ReadWrite"
                        }
                        (AddressSpace::Storage { .. }, _) => "Read",
                        (
                            _,
                            TypeInner::Image {
                                class: ImageClass::Sampled { kind: ScalarKind::Uint, .. },
                                ..
                            },
                        ) => "TextureUint",
                        (_, TypeInner::Image { class: ImageClass::Storage { .. }, .. }) => "StorageTexture",
                        (_, TypeInner::Image { .. }) => "TextureFloat",
                        _ => "unknown",
                    };
                    let b = v.binding?;
                    Some((b.group, b.binding, v.name.as_deref().unwrap_or(""), kind))
                })
                .collect();
            bound.sort_unstable();
            let mut names: Vec<_> = bound.iter().map(|b| b.2).collect();
            names.sort_unstable();
            names.dedup();
            assert_eq!(
                names.len(),
                bound.len(),
                "{}::{}: names are what host code binds by",
                module.name,
                entry.name
            );
            writeln!(
                text,
                "    EntryPoint {{ module: {:?}, name: {:?}, workgroup_size: {:?}, bindings: &[",
                module.name, entry.name, entry.workgroup_size
            )
            .unwrap();
            for (group, binding, name, kind) in bound {
                writeln!(text, "        at({group}, {binding}, {name:?}, {kind}),").unwrap();
            }
            text.push_str("    ] },\n");
        }
    }
    text.push_str("];\n");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/bindings.rs");
    if std::env::var("INDIRECT_BLESS").is_ok_and(|v| v == "1") {
        std::fs::write(&path, &text).unwrap();
    }
    let stored = std::fs::read_to_string(&path).unwrap();
    assert!(
        stored == text,
        "src/bindings.rs is out of date: run INDIRECT_BLESS=1 cargo test -p indirect-shaders"
    );
}
