//! The structs of `core/*.wgsl` lie in memory as their Rust twins do. No GPU needed.

use indirect_core::NO_TRIANGLE;
use indirect_gpu::layout::{MaterialUniform, NO_TEXTURE, SceneInfo, TextureUniform, ViewUniform};
use indirect_gpu::shaders::{RESOLVE, SCENE, VIEW};
use testkit::assert_layout;
use testkit::layout::{check_constant, check_workgroup_size};

#[test]
fn structs() {
    assert_layout!(
        VIEW,
        "View" = ViewUniform {
            origin,
            near,
            right,
            orthographic,
            up,
            depth_scale,
            forward,
            depth_offset,
            half_extent,
            size,
            first_texel,
        }
    );
    assert_layout!(SCENE, "TextureRef" = TextureUniform { transform, translation, size, wrap, first_texel });
    assert_layout!(
        SCENE,
        "Material" = MaterialUniform {
            base_color,
            metallic,
            base_alpha,
            alpha_cutoff,
            base_color_texture,
            metallic_roughness_texture,
        }
    );
    assert_layout!(SCENE, "SceneInfo" = SceneInfo { vertex_stride, triangles });
}

#[test]
fn constants_and_workgroups() {
    check_constant(&SCENE, "NO_TRIANGLE", NO_TRIANGLE).unwrap();
    check_constant(&SCENE, "NO_TEXTURE", NO_TEXTURE).unwrap();
    check_workgroup_size(&RESOLVE, "resolve", [8, 8, 1]).unwrap();
}
