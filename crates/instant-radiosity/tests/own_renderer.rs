//! What a renderer of somebody else relies on: the example `own_renderer` makes the picture that the crate's own raster makes, buffers
//! follow the size of the image, and maps may come from elsewhere.
#![allow(clippy::print_stdout, reason = "figures of a test")]

use instant_radiosity::InstantRadiosity;
use rsm::views::views;

#[allow(dead_code, unreachable_pub, missing_docs, reason = "an example, whose main is not called")]
#[path = "../examples/own_renderer.rs"]
mod example;

#[test]
fn a_renderer_of_ones_own_gets_the_picture_of_the_own_raster() {
    let source = include_str!("../examples/own_renderer.rs");
    testkit::own_renderer::check::<example::Indirect, InstantRadiosity>(example::settings(), views, source);
}

#[test]
fn buffers_follow_the_size_of_the_image() {
    testkit::resources::check_resize::<InstantRadiosity>(example::settings(), &[]);
}

#[test]
fn maps_may_come_from_elsewhere() {
    testkit::resources::check_maps::<InstantRadiosity>(example::settings());
}
