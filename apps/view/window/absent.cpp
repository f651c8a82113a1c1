// Stands in for the window if its libraries were not found at build.

#include "apps/palpate/command.h"

namespace palpate {

Command add_view(CLI::App& app) {
    app.allow_extras();
    return {[]() -> Result<void> {
                return fail(
                    "palpate view: expected GLFW and Dear ImGui (libglfw3-dev, libimgui-dev, "
                    "libstb-dev) when the program was built, found neither; install them and build "
                    "again");
            },
            [] { return std::vector<NamedFile>(); }};
}

} // namespace palpate
