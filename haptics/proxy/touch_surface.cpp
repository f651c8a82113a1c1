// The mesh that swept-mesh feels, made before it is published; declared in swept_mesh.h.

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "engine/surface/block_surface.h"
#include "engine/surface/marching_cubes.h"
#include "engine/volume/builder.h"
#include "haptics/field/field.h"
#include "haptics/field/fine_samples.h"
#include "haptics/field/rigid_space.h"
#include "haptics/proxy/swept_mesh.h"

namespace palpate::haptics {

namespace {

// How far triangles bulge at most, as a share of their mean edge.
constexpr double kBulge = 0.25;
constexpr size_t kMostPoints = size_t{1} << 26; // of the finer lattice: 256 MiB of floats
constexpr int kBorder = 2;                      // samples beyond the volume, where all is free

// One brick of the finer lattice, whose first point is point `from` of `samples`.
BrickPtr fine_brick(FineSamples& samples, const Grid& grid, glm::uvec3 position, glm::ivec3 from) {
    constexpr int kSide = FineSamples::kMostSide, kBricks = static_cast<int>(kBrickSide);
    const glm::uvec3 start = position * kBrickSide;
    const glm::uvec3 valid = glm::min(glm::uvec3(kBrickSide), grid.size - start);
    const glm::ivec3 first = from + glm::ivec3(start);
    // If all points and those next to them lie on one side of the surface, any value on that side
    // will do: normals come from elsewhere.
    using Matter = FineSamples::Matter;
    const float free = samples.free_value(), solid = 2.0f * samples.threshold() - free;
    const auto value_of = [&](Matter matter) { return matter == Matter::free ? free : solid; };
    if (const Matter all = samples.matter(first - 1, first + kBricks); all != Matter::unknown) {
        const float value = value_of(all);
        return Brick::make(std::span<const float>(&value, 1), valid);
    }
    std::vector<float> staged(kBrickSamples);
    for (int z = 0; z < kBricks; z += kSide)
        for (int y = 0; y < kBricks; y += kSide)
            for (int x = 0; x < kBricks; x += kSide) {
                const glm::ivec3 low(x, y, z), size = glm::min(glm::ivec3(kSide), kBricks - low);
                const Matter all = samples.matter(first + low - 1, first + low + kSide);
                const float* sharp =
                    all == Matter::unknown ? samples.sharp(first + low, kSide).values : nullptr;
                for (int k = 0; k < size.z; ++k)
                    for (int j = 0; j < size.y; ++j) {
                        float* row = &staged[offset_in_brick(glm::uvec3(x, y + j, z + k))];
                        if (sharp)
                            std::copy_n(sharp + kSide * (j + kSide * k), size.x, row);
                        else
                            std::fill_n(row, size.x, value_of(all));
                    }
            }
    return Brick::make(std::span<const float>(staged), valid);
}

template <class Visit>
void for_range(glm::ivec3 from, glm::ivec3 to, const Visit& visit) { // both inclusive
    for (int z = from.z; z <= to.z; ++z)
        for (int y = from.y; y <= to.y; ++y)
            for (int x = from.x; x <= to.x; ++x)
                visit(glm::ivec3(x, y, z));
}

// The finer lattice: bricks of it as a volume.
class FineLattice {
 public:
    FineLattice(const Volume& volume, const TouchParameters& parameters)
        : parameters_(parameters), samples_(finer_for(volume.grid())), grid_(volume.grid()) {
        grid_.size = (grid_.size - 1u + 2u * kBorder) * uint32_t(samples_.finer()) + 1u;
        grid_.world_from_index =
            glm::scale(glm::translate(grid_.world_from_index, glm::dvec3(-kBorder)),
                       glm::dvec3(1.0 / samples_.finer()));
        samples_.follow(volume, parameters_);
        settings_ = samples_.settings();
    }

    float threshold() const { return samples_.threshold(); }
    // All of it.
    Volume make() {
        return made([&](glm::uvec3) { return true; }, nullptr);
    }
    // A box of points, both ends inclusive.
    struct Box {
        glm::ivec3 low, high;
    };
    // The points that read a sample that differs between two snapshots, in either view; none where
    // the range of values makes every point another.
    std::optional<std::vector<Box>> follow(const Volume& after,
                                           std::span<const ChangedBrick> changed) {
        samples_.follow(after, parameters_);
        if (std::exchange(settings_, samples_.settings()) != settings_)
            return {};
        // A point reads samples within kReads of it.
        constexpr int kReads = Filter::kMostReach + 3;
        const auto point_of = [&](glm::ivec3 sample) {
            return glm::clamp((sample + kBorder) * samples_.finer(), glm::ivec3(0),
                              glm::ivec3(grid_.size) - 1);
        };
        std::vector<Box> boxes;
        for (const ChangedBrick& brick : changed) {
            const auto [low, high] = changed_samples(brick);
            const glm::ivec3 start(brick.position * kBrickSide);
            boxes.push_back({point_of(start + glm::ivec3(low) - kReads),
                             point_of(start + glm::ivec3(high) + kReads)});
        }
        return boxes;
    }
    // Makes `before` again, but with new bricks where they hold points of the boxes.
    Volume make_again(const Volume& before, std::span<const Box> boxes) {
        const glm::ivec3 count = glm::ivec3(grid_.size / kBrickSide) + 1;
        std::vector<bool> again(size_t(count.x) * size_t(count.y) * size_t(count.z));
        const auto at = [&](glm::ivec3 p) {
            return size_t(p.x) + size_t(count.x) * (size_t(p.y) + size_t(count.y) * size_t(p.z));
        };
        for (const Box& box : boxes)
            for_range(box.low / int(kBrickSide), box.high / int(kBrickSide),
                      [&](glm::ivec3 brick) { again[at(brick)] = true; });
        return made([&](glm::uvec3 position) { return bool(again[at(glm::ivec3(position))]); },
                    &before);
    }

 private:
    static int finer_for(const Grid& grid) {
        int finer = FineSamples::kMostFiner;
        while (finer > 1 && sample_count(grid) * size_t(finer * finer * finer) > kMostPoints)
            --finer;
        return finer;
    }
    template <class IsNew>
    Volume made(const IsNew& is_new, const Volume* before) {
        VolumeBuilder builder(grid_, ScalarType::f32);
        const glm::uvec3 count = builder.brick_count();
        const glm::ivec3 first(-kBorder * samples_.finer());
        for (uint32_t z = 0; z < count.z; ++z)
            for (uint32_t y = 0; y < count.y; ++y)
                for (uint32_t x = 0; x < count.x; ++x)
                    builder.set_brick({x, y, z}, is_new(glm::uvec3(x, y, z))
                                                     ? fine_brick(samples_, grid_, {x, y, z}, first)
                                                     : before->brick_ptr({x, y, z}));
        return builder.finish();
    }

    TouchParameters parameters_;
    FineSamples samples_;
    Grid grid_;
    uint64_t settings_ = 0;
};

// Normals of the smooth view at the vertices themselves, where it has a slope. (A field knows no
// opacity table.)
void take_smooth_normals(Field& field, const glm::dmat4& world_from_mesh,
                         std::span<const glm::vec3> positions, std::span<glm::vec3> normals) {
    // Gradients are covectors: they take the inverse transpose of the way from world to mesh.
    const glm::dmat3 mesh_from_gradient = glm::transpose(glm::dmat3(world_from_mesh));
    for (size_t i = 0; i < positions.size(); ++i) {
        const glm::dvec3 at(world_from_mesh * glm::dvec4(positions[i], 1.0));
        const glm::dvec3 down = field.smooth(at).gradient;
        if (glm::length(down) > 0.0)
            normals[i] = glm::vec3(-glm::normalize(mesh_from_gradient * down));
    }
}

double cell_mm_of(const Grid& grid) {
    const glm::dvec3 spacing = spacing_mm(grid);
    return 0.5 * std::cbrt(spacing.x * spacing.y * spacing.z);
}

} // namespace

Mesh touch_surface(const Volume& volume, const TouchParameters& parameters) {
    FineLattice lattice(volume, parameters);
    Mesh mesh = marching_cubes(lattice.make(), lattice.threshold());
    if (parameters.opacity.point_count == 0) {
        const auto field = std::make_unique<Field>();
        field->follow(volume, parameters);
        take_smooth_normals(*field, mesh.world_from_mesh, mesh.positions, mesh.normals);
    }
    return mesh;
}

struct TouchSurface::State {
    Volume volume;
    TouchParameters parameters;
    FineLattice lattice;
    BlockSurface surface;
    std::unique_ptr<Field> field;                                 // null with an opacity table
    std::unordered_map<uint64_t, std::vector<glm::vec3>> normals; // of blocks

    State(const Volume& first, const TouchParameters& p)
        : volume(first),
          parameters(p),
          lattice(first, p),
          surface(lattice.make(), lattice.threshold()) {
        take_all_normals();
    }
    static uint64_t key(glm::ivec3 block) {
        return uint64_t(uint32_t(block.x)) | uint64_t(uint32_t(block.y)) << 21 |
               uint64_t(uint32_t(block.z)) << 42;
    }
    void take_all_normals() {
        field = parameters.opacity.point_count > 0 ? nullptr : std::make_unique<Field>();
        normals.clear();
        take_normals(surface.blocks());
    }
    void take_normals(std::span<const glm::ivec3> blocks) {
        if (field)
            field->follow(volume, parameters);
        for (const glm::ivec3 at : blocks) {
            const BlockMesh* block = surface.block(at);
            if (!block) {
                normals.erase(key(at));
                continue;
            }
            std::vector<glm::vec3>& own = normals[key(at)] = block->normals;
            if (field)
                take_smooth_normals(*field, world_from_mesh(surface.volume().grid()),
                                    block->positions, own);
        }
    }
};

TouchSurface::TouchSurface(const Volume& volume, const TouchParameters& parameters)
    : state_(std::make_unique<State>(volume, parameters)) {}
TouchSurface::~TouchSurface() = default;

const Volume& TouchSurface::volume() const {
    return state_->volume;
}

size_t TouchSurface::follow(const Volume& after) {
    State& s = *state_;
    const std::vector<ChangedBrick> changed = changed_bricks(s.volume, after);
    const auto boxes = s.lattice.follow(after, changed);
    s.volume = after;
    if (!boxes) {
        s.surface = BlockSurface(s.lattice.make(), s.lattice.threshold());
        s.take_all_normals();
        return s.surface.blocks().size();
    }
    const BlockSurface::Update update =
        s.surface.update(s.lattice.make_again(s.surface.volume(), *boxes));
    // The smooth view reaches farther than the sharp one: beside the blocks that were made again
    // lie blocks of which only the normals change.
    constexpr int kSide = static_cast<int>(kBlockSide);
    std::vector<glm::ivec3> blocks = update.blocks;
    for (const FineLattice::Box& box : *boxes)
        for_range(glm::max(box.low - 1, 0) / kSide, box.high / kSide, [&](glm::ivec3 block) {
            if (s.surface.block(block))
                blocks.push_back(block);
        });
    std::sort(blocks.begin(), blocks.end(),
              [](glm::ivec3 a, glm::ivec3 b) { return State::key(a) < State::key(b); });
    blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
    s.take_normals(blocks);
    return update.blocks.size();
}

std::shared_ptr<const TouchMesh> TouchSurface::mesh() const {
    const State& s = *state_;
    auto mesh = std::make_shared<Mesh>();
    mesh->world_from_mesh = world_from_mesh(s.surface.volume().grid());
    for (const glm::ivec3 at : s.surface.blocks()) {
        const BlockMesh& block = *s.surface.block(at);
        const std::vector<glm::vec3>& normals = s.normals.at(State::key(at));
        const auto base = static_cast<uint32_t>(mesh->positions.size());
        mesh->positions.insert(mesh->positions.end(), block.positions.begin(),
                               block.positions.end());
        mesh->normals.insert(mesh->normals.end(), normals.begin(), normals.end());
        for (const glm::uvec3 t : block.triangles)
            mesh->triangles.push_back(t + base);
    }
    return make_touch_mesh(std::move(mesh), cell_mm_of(s.volume.grid()));
}

std::shared_ptr<const TouchMesh> make_touch_mesh(std::shared_ptr<const Mesh> mesh,
                                                 double grain_mm) {
    if (const RigidSpace space = rigid_space(mesh->world_from_mesh); !space.is_mesh_space) {
        auto rigid = std::make_shared<Mesh>(*mesh);
        rigid->world_from_mesh = space.world_from_rigid;
        for (glm::vec3& p : rigid->positions)
            p = glm::vec3(space.from_mesh * glm::dvec3(p));
        for (glm::vec3& n : rigid->normals)
            n = glm::vec3(glm::normalize(space.normal_from_mesh * glm::dvec3(n)));
        mesh = std::move(rigid);
    }
    auto made = std::make_shared<TouchMesh>();
    made->mesh = mesh;
    made->mesh_from_world = glm::inverse(mesh->world_from_mesh);
    glm::vec3 low(0.0f), high(0.0f);
    if (!mesh->positions.empty())
        low = high = mesh->positions[0];
    for (const glm::vec3 p : mesh->positions) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    double edges = 0.0;
    for (const glm::uvec3 t : mesh->triangles)
        for (int k = 0; k < 3; ++k)
            edges += double{glm::distance(mesh->positions[t[k]], mesh->positions[t[(k + 1) % 3]])};
    const double edge = edges / std::max(1.0, 3.0 * static_cast<double>(mesh->triangles.size()));
    if (!mesh->normals.empty())
        made->bulge_mm = kBulge * edge;
    made->grain_mm = std::max(grain_mm, 1e-3);
    // A surface that passes a cell of three edges has some 20 triangles there.
    double cell = std::max(std::min(grain_mm, 3.0 * edge), 1e-3);
    const auto cells_of = [&] { return glm::ivec3((high - low) / static_cast<float>(cell)) + 1; };
    while (double(cells_of().x) * cells_of().y * cells_of().z > 4194304.0)
        cell *= 1.26;
    made->low_mm = low;
    made->cell_mm = static_cast<float>(cell);
    made->cells = cells_of();
    const size_t count = size_t(made->cells.x) * size_t(made->cells.y) * size_t(made->cells.z);
    made->first.assign(count + 1, 0);
    const auto for_cells = [&](const glm::uvec3 t, const auto& visit) {
        const glm::vec3 a = mesh->positions[t.x], b = mesh->positions[t.y],
                        c = mesh->positions[t.z];
        const glm::ivec3 last = made->cells - 1;
        const glm::ivec3 from = glm::clamp(
            glm::ivec3((glm::min(glm::min(a, b), c) - low) / made->cell_mm), glm::ivec3(0), last);
        const glm::ivec3 to = glm::clamp(
            glm::ivec3((glm::max(glm::max(a, b), c) - low) / made->cell_mm), glm::ivec3(0), last);
        for (int z = from.z; z <= to.z; ++z)
            for (int y = from.y; y <= to.y; ++y)
                for (int x = from.x; x <= to.x; ++x)
                    visit(size_t(x) +
                          size_t(made->cells.x) * (size_t(y) + size_t(made->cells.y) * size_t(z)));
    };
    for (const glm::uvec3 t : mesh->triangles)
        for_cells(t, [&](size_t c) { ++made->first[c + 1]; });
    for (size_t c = 0; c < count; ++c)
        made->first[c + 1] += made->first[c];
    made->triangles.resize(made->first[count]);
    std::vector<uint32_t> at(made->first.begin(), made->first.end() - 1);
    for (const glm::uvec3 t : mesh->triangles)
        for_cells(t, [&](size_t c) { made->triangles[at[c]++] = t; });
    return made;
}

} // namespace palpate::haptics
