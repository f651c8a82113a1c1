#pragma once

#include <initializer_list>
#include <utility>

#include "engine/scene/scene.h"

namespace palpate {

// Names of a scene's choices in files, options and messages.
template <class Enum>
struct Names;
template <>
struct Names<Projection> {
    static constexpr std::initializer_list<std::pair<const char*, Projection>> list{
        {"perspective", Projection::perspective}, {"orthographic", Projection::orthographic}};
};
template <>
struct Names<RayMode> {
    static constexpr std::initializer_list<std::pair<const char*, RayMode>> list{
        {"alpha", RayMode::alpha}, {"mip", RayMode::mip}, {"iso", RayMode::iso}};
};
template <>
struct Names<Integrator> {
    static constexpr std::initializer_list<std::pair<const char*, Integrator>> list{
        {"fast", Integrator::fast},
        {"preintegrated", Integrator::preintegrated},
        {"exact", Integrator::exact}};
};
template <>
struct Names<StereoLayout> {
    static constexpr std::initializer_list<std::pair<const char*, StereoLayout>> list{
        {"side_by_side", StereoLayout::side_by_side},
        {"top_bottom", StereoLayout::top_bottom},
        {"row_interleaved", StereoLayout::row_interleaved},
        {"column_interleaved", StereoLayout::column_interleaved},
        {"checkerboard", StereoLayout::checkerboard},
        {"anaglyph", StereoLayout::anaglyph},
        {"left", StereoLayout::left},
        {"right", StereoLayout::right},
        {"separate", StereoLayout::separate}};
};
template <>
struct Names<SlabMode> {
    static constexpr std::initializer_list<std::pair<const char*, SlabMode>> list{
        {"mean", SlabMode::mean}, {"maximum", SlabMode::maximum}, {"minimum", SlabMode::minimum}};
};
template <>
struct Names<Interpolation> {
    static constexpr std::initializer_list<std::pair<const char*, Interpolation>> list{
        {"linear", Interpolation::linear}, {"cubic", Interpolation::cubic}};
};
template <>
struct Names<LabelEdges> {
    static constexpr std::initializer_list<std::pair<const char*, LabelEdges>> list{
        {"smooth", LabelEdges::smooth}, {"voxels", LabelEdges::voxels}};
};

} // namespace palpate
