//! The structs of `core/*.wgsl` lie in memory as their Rust twins do. No GPU needed.

use indirect_core::NO_TRIANGLE;
use indirect_gpu::layout::{MaterialUniform, NO_TEXTURE, SceneInfo, TextureUniform, ViewUniform};
use indirect_gpu::shaders::{RESOLVE, SCENE, VIEW};
use testkit::layout::{check, check_constant, check_workgroup_size};

#[test]
fn structs() {
    check::<ViewUniform>(&VIEW).unwrap();
    check::<TextureUniform>(&SCENE).unwrap();
    check::<MaterialUniform>(&SCENE).unwrap();
    check::<SceneInfo>(&SCENE).unwrap();
}

#[test]
fn constants_and_workgroups() {
    check_constant(&SCENE, "NO_TRIANGLE", NO_TRIANGLE).unwrap();
    check_constant(&SCENE, "NO_TEXTURE", NO_TEXTURE).unwrap();
    check_workgroup_size(&RESOLVE, "resolve", [8, 8, 1]).unwrap();
}
