#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "engine/net/interactive_net.h"
#include "engine/net/monai_label.h"

// A net's labels, whichever protocol its server speaks.
namespace palpate {

// Whether a server that was named is there, and what it has. Nothing of a volume is sent.
struct FoundNet {
    NetServer server;
    bool is_interactive = false;           // nnInteractive's protocol; else MONAI Label's
    std::vector<MonaiModel> models{};      // of MONAI Label
    std::shared_ptr<InteractiveNet> net{}; // of nnInteractive: with a lease
};
Result<FoundNet> find_net(const NetServer& server, const std::stop_token& stop);

// The model of a name, or the only one where no name is given. Refused: others, with all names.
Result<MonaiModel> model_of(const FoundNet& found, const std::string& name);

// The licence of the net's weights as the server states it, in a sentence.
std::string license_sentence(const FoundNet& found, const MonaiModel* model);

// The words of a consent: what goes where, whether it is encrypted on the way, and where others
// can read the key.
std::string sending_sentence(const Volume& volume, const NetServer& server);

// Places that a person has shown, on the volume's grid, of the labels in order.
struct NetSeeds {
    std::map<uint16_t, std::vector<glm::uvec3>> points; // at least one of both
    std::optional<Volume> drawn;                        // a label map; 0 is no seed
    std::optional<Volume> start;                        // masks to begin with, by label
    uint16_t background = 0;                            // a label that is no object; 0: none
};

// Asks for each label of the seeds, with the seeds of all others as what it is not, and returns the
// labels in one map of the volume's grid; where two objects meet, the smaller label has the
// sample. Models of MONAI Label that take no points give their labels as they are. A failure leaves
// nothing behind.
Result<Volume> ask_net(const FoundNet& found, const MonaiModel* model, const Volume& volume,
                       const NetSeeds& seeds, const std::stop_token& stop,
                       const std::function<void(double share)>& progress = {});

} // namespace palpate
