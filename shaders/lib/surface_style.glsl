// Which style a triangle is seen in. Needs lib/surface.glsl.

layout(scalar, binding = kSurfaceStyles) readonly buffer Styles { SurfaceStyleEntry styles[]; };
layout(scalar, binding = kSurfaceLabels) readonly buffer Labels { uint labels[]; }; // | outer << 16

uint labels_of(SurfaceMesh mesh, uint triangle) {
    const bool labelled = (mesh.flags & kSurfaceHasLabels) != 0u;
    return labelled ? labels[labelled ? triangle : 0u] : 0u;
}

uint style_of_label(SurfaceMesh mesh, uint label) {
    return mesh.first_style + min(label, mesh.style_count - 1u);
}

// The style of the label that the ray enters or, where that one is not shown, of the one that it leaves.
uint style_of(SurfaceMesh mesh, uint pair, bool leaving) {
    const uint inner = style_of_label(mesh, pair & 0xffffu);
    const uint outer = style_of_label(mesh, pair >> 16);
    const uint far = leaving ? outer : inner;
    return styles[far].color.a > 0.0 ? far : (leaving ? inner : outer);
}

// The weight with which a ray counts that leaves the triangle's inner side.
int weight_of(SurfaceMesh mesh, uint pair) {
    const bool labelled = (mesh.flags & kSurfaceHasLabels) != 0u;
    return labelled ? int(pair & 0xffffu) - int(pair >> 16) : 1;
}
