#include "apps/view/document/mesh_writing.h"

#include <fmt/format.h>

#include "apps/view/document/free_name.h"
#include "engine/io/mesh_io.h"

namespace palpate::view {

void MeshWriting::begin(const MeshExport& wanted, const std::string& path) {
    if (!document_.threaded())
        return document_.tell("a script saves nothing");
    if (done_.valid())
        return document_.tell("writing; one surface at a time");
    if (!has_mesh_extension(path))
        return document_.tell(
            fmt::format("{}: expected a name that ends in .stl, .ply, .obj or .vtp", path));
    document_.session().settle();
    const std::optional<Volume> volume = wanted.iso ? document_.grey() : document_.labels();
    if (!volume)
        return document_.tell("there are no labels to write: draw or segment first");
    std::error_code ignored;
    const auto file = std::filesystem::absolute(free_name(path), ignored);
    stop_ = {};
    now_ = std::make_shared<Now>();
    done_ = std::async(
        std::launch::async,
        [volume = *volume, wanted, file, now = now_,
         stop = stop_.get_token()]() -> Result<std::string> {
            try {
                PALPATE_TRY(
                    const MeshExported made,
                    make_mesh_export(volume, wanted, stop, [&](const char* what, double share) {
                        now->what = what;
                        now->share = share;
                    }));
                now->what = "writing";
                PALPATE_TRY(save_mesh(file, made.mesh, {.stop = stop}));
                return fmt::format("{}: {}", file.string(), made.told);
            } catch (const std::exception& error) { // such as memory that is not there
                return fail("{}: {}", file.string(), error.what());
            }
        });
    document_.tell("making " + Message::name(file.string()) + " ..");
}

std::optional<MeshWriting::Share> MeshWriting::share() const {
    return done_.valid() ? std::optional<Share>({now_->what, now_->share}) : std::nullopt;
}

void MeshWriting::poll() {
    if (!done_.valid() || done_.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
        return;
    const Result<std::string> done = done_.get();
    last_ = done ? Message::of_files(*done) : Message::why(done.error());
    document_.tell(last_);
}

} // namespace palpate::view
