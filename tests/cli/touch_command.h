#pragma once

#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/program.h"

namespace palpate {

// Runs of palpate touch on small volumes, and what they report.
class TouchCommand : public ProgramTest {
 protected:
    // The report's columns by name; those that are no numbers are left out.
    std::map<std::string, std::vector<double>> table(const std::string& name) const {
        std::istringstream text(bytes_of(name));
        std::string line, cell;
        std::getline(text, line);
        std::vector<std::string> names;
        for (std::istringstream head(line); std::getline(head, cell, ',');)
            names.push_back(cell);
        std::map<std::string, std::vector<double>> columns;
        while (std::getline(text, line)) {
            std::istringstream row(line);
            for (size_t c = 0; std::getline(row, cell, ','); ++c)
                if (names.at(c) != "contact" && names.at(c) != "faults")
                    columns[names.at(c)].push_back(std::stod(cell));
        }
        return columns;
    }
    void write_path() const {
        // Down onto a ball of 35 mm radius from 8 mm above it, 3 mm deep, and up again.
        write("path.csv",
              "time_s,x_mm,y_mm,z_mm,button\n0,0,0,43,0\n0.4,0,0,32,0\n0.6,0,0,32,1\n1,0,0,43,0\n");
    }
    // NRRD of 24^3 samples of 1 mm about the origin.
    template <class Value>
    void write_nrrd(const std::string& name, const char* type, const Value& value) const {
        std::string text = std::string("NRRD0004\ntype: ") + type +
                           "\ndimension: 3\nsizes: 24 24 24\nspace: left-posterior-superior\n"
                           "space directions: (1,0,0) (0,1,0) (0,0,1)\n"
                           "space origin: (-12,-12,-12)\nencoding: ascii\n\n";
        for (int z = -12; z < 12; ++z)
            for (int y = -12; y < 12; ++y)
                for (int x = -12; x < 12; ++x)
                    text += std::to_string(value(x, z)) + (x == 11 ? "\n" : " ");
        write(name, text);
    }
    void write_two_labels() const {
        write_nrrd("labels.nrrd", "uint8", [](int x, int z) { return z >= 0 ? 0 : x < 0 ? 1 : 2; });
    }
    std::vector<std::string> arguments(const std::string& algorithm) const {
        return {"touch",       "synthetic:ball?size=64",
                "--path",      file("path.csv").string(),
                "--iso",       "500",
                "--report",    file("r.csv").string(),
                "--device",    "exact",
                "--algorithm", algorithm};
    }
};

} // namespace palpate
