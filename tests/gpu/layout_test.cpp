// The structs that C++ and GLSL share lie the same in both: the offsets in the built SPIR-V are
// those of C++.

#include <gtest/gtest.h>

#include <map>
#include <span>
#include <string>
#include <vector>

#include "engine/render/shader_code.h"
#include "shaders/shared/ray_cast.h"
#include "shaders/shared/surface.h"

namespace palpate {
namespace {

// Member offsets of every struct in a SPIR-V module, by struct and member name (the first of each
// struct name: blocks are the only decorated ones).
std::map<std::string, std::map<std::string, uint32_t>> offsets_in(std::span<const uint32_t> words) {
    constexpr uint32_t kOpName = 5, kOpMemberName = 6, kOpMemberDecorate = 72, kOffset = 35;
    std::map<uint32_t, std::string> names;
    std::map<std::pair<uint32_t, uint32_t>, std::string> members;
    std::map<std::string, std::map<std::string, uint32_t>> offsets;
    for (size_t i = 5; i < words.size(); i += words[i] >> 16) {
        const uint32_t* op = &words[i];
        switch (op[0] & 0xffff) {
            case kOpName:
                names[op[1]] = reinterpret_cast<const char*>(op + 2);
                break;
            case kOpMemberName:
                members[{op[1], op[2]}] = reinterpret_cast<const char*>(op + 3);
                break;
            case kOpMemberDecorate:
                if (op[3] == kOffset)
                    offsets[names[op[1]]][members[{op[1], op[2]}]] = op[4];
                break;
            default:
                break;
        }
    }
    return offsets;
}

TEST(SharedStructs, OffsetsInSpirvAreThoseOfCpp) {
    const auto found = offsets_in(ray_cast_shader());
    ASSERT_TRUE(found.contains("Frame") && found.contains("FrameEye") &&
                found.contains("ClipPlaneIndex"));
#define EXPECT_OFFSET(Struct, member) \
    EXPECT_EQ(found.at(#Struct).at(#member), offsetof(gpu::Struct, member)) << #member
    EXPECT_OFFSET(FrameEye, eye);
    EXPECT_OFFSET(FrameEye, right);
    EXPECT_OFFSET(FrameEye, up);
    EXPECT_OFFSET(FrameEye, forward);
    EXPECT_OFFSET(FrameEye, bounds);
    EXPECT_OFFSET(FrameEye, projection);
    EXPECT_OFFSET(FrameEye, spread);
    EXPECT_OFFSET(FrameEye, reach);
    EXPECT_OFFSET(ClipPlaneIndex, normal);
    EXPECT_OFFSET(ClipPlaneIndex, offset);
    EXPECT_OFFSET(Frame, eyes);
    EXPECT_OFFSET(Frame, clips);
    EXPECT_OFFSET(Frame, last);
    EXPECT_OFFSET(Frame, texture_from_index);
    EXPECT_OFFSET(Frame, world_from_index_covector);
    EXPECT_OFFSET(Frame, label_from_index);
    EXPECT_OFFSET(Frame, label_origin);
    EXPECT_OFFSET(Frame, background);
    EXPECT_OFFSET(Frame, value_scale);
    EXPECT_OFFSET(Frame, table_scale);
    EXPECT_OFFSET(Frame, table_first);
    EXPECT_OFFSET(Frame, table_last);
    EXPECT_OFFSET(Frame, cell_last);
    EXPECT_OFFSET(Frame, cell_texture);
    EXPECT_OFFSET(Frame, cell_side);
    EXPECT_OFFSET(Frame, cell_margin);
    EXPECT_OFFSET(Frame, step);
    EXPECT_OFFSET(TileEntry, tile);
    EXPECT_OFFSET(TileEntry, near);
    EXPECT_OFFSET(TileEntry, far);
    EXPECT_OFFSET(TileEntry, samples);
    EXPECT_OFFSET(Frame, min_transmittance);
    EXPECT_OFFSET(Frame, opacity_unit_mm);
    EXPECT_OFFSET(Frame, label_weight);
    EXPECT_OFFSET(Frame, outline_px);
    EXPECT_OFFSET(Frame, shading);
    EXPECT_OFFSET(Frame, iso_texels);
    EXPECT_OFFSET(Frame, iso_colors);
    EXPECT_OFFSET(Frame, size_px);
    EXPECT_OFFSET(Frame, style_count);
    EXPECT_OFFSET(Frame, jitter_mm);
    EXPECT_OFFSET(Frame, jitter_seed);
    const auto with_atlas = offsets_in(ray_cast_atlas_shader());
    ASSERT_TRUE(with_atlas.contains("AtlasFrame"));
#define EXPECT_ATLAS_OFFSET(member) \
    EXPECT_EQ(with_atlas.at("AtlasFrame").at(#member), offsetof(gpu::AtlasFrame, member)) << #member
    EXPECT_ATLAS_OFFSET(pages_texture);
    EXPECT_ATLAS_OFFSET(image_texture);
    EXPECT_ATLAS_OFFSET(inset);
    EXPECT_ATLAS_OFFSET(part_low);
    EXPECT_ATLAS_OFFSET(part_high);
    EXPECT_ATLAS_OFFSET(part_eyes);
    EXPECT_ATLAS_OFFSET(first_part);
#undef EXPECT_ATLAS_OFFSET
#undef EXPECT_OFFSET
}

TEST(SharedStructs, OffsetsOfSurfacesInSpirvAreThoseOfCpp) {
    const auto found = offsets_in(surface_draw_shader());
    for (const char* name : {"SurfaceMesh", "SurfaceClip", "SurfaceFrame", "SurfaceStyleEntry"})
        ASSERT_TRUE(found.contains(name)) << name;
#define EXPECT_OFFSET(Struct, member) \
    EXPECT_EQ(found.at(#Struct).at(#member), offsetof(gpu::Struct, member)) << #member
    EXPECT_OFFSET(SurfaceMesh, camera_from_mesh);
    EXPECT_OFFSET(SurfaceMesh, origin);
    EXPECT_OFFSET(SurfaceMesh, covector_from_mesh);
    EXPECT_OFFSET(SurfaceMesh, triangle_count);
    EXPECT_OFFSET(SurfaceMesh, first_style);
    EXPECT_OFFSET(SurfaceMesh, style_count);
    EXPECT_OFFSET(SurfaceMesh, flags);
    EXPECT_OFFSET(SurfaceClip, normal);
    EXPECT_OFFSET(SurfaceClip, offset);
    EXPECT_OFFSET(SurfaceFrame, meshes);
    EXPECT_OFFSET(SurfaceFrame, clips);
    EXPECT_OFFSET(SurfaceFrame, bounds);
    EXPECT_OFFSET(SurfaceFrame, size_px);
    EXPECT_OFFSET(SurfaceFrame, orthographic);
    EXPECT_OFFSET(SurfaceFrame, first_row);
    EXPECT_OFFSET(SurfaceFrame, rows);
    EXPECT_OFFSET(SurfaceFrame, eye);
    EXPECT_OFFSET(SurfaceFrame, mesh_count);
    EXPECT_OFFSET(SurfaceFrame, clip_count);
    EXPECT_OFFSET(SurfaceFrame, depth);
    EXPECT_OFFSET(SurfaceStyleEntry, color);
    EXPECT_OFFSET(SurfaceStyleEntry, shading);
    EXPECT_OFFSET(SurfaceStyleEntry, value);
#undef EXPECT_OFFSET
}

} // namespace
} // namespace palpate
