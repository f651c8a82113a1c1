#pragma once

#include <cstdint>

// The one kind of graphics pipeline of the driver: the window's interface. Triangles of vertices
// with a position in pixels, a place in a texture (two floats each) and a colour of 8 bits a
// channel; the colour times the texture is laid over an image of 8 bits a channel by its alpha.
namespace palpate::native {

// Lets pipelines of these two shaders (hash_of() their words) draw such triangles.
void know_triangles(uint64_t vertex_hash, uint64_t fragment_hash);

} // namespace palpate::native
