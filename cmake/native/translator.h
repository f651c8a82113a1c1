#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "module.h"
#include "opcodes.h"

namespace translator {

// One scalar of a value: a constant, or a variable of the C++ that is written. `uniform` is the
// same in all lanes that run.
struct Part {
    std::string text;
    char kind = 'u'; // f, u or b
    bool uniform = true;
    int variable = -1;
};
using Parts = std::vector<Part>;

struct Variable {
    std::string name;
    int scope = 0;
    std::vector<uint32_t> loops; // that it is written in, outermost first
};

// A module of a program that a kernel serves.
struct Served {
    std::string name; // of the kernel in C++
    uint64_t hash = 0;
    uint32_t number = 0; // bit i is the value of constant kFirstFolded + i
    std::set<uint32_t> bindings;
};
constexpr uint32_t kFirstFolded = 1000;

// A pointer leads to words of a bound block, of shared memory, or of a lane's own array.
struct Pointer {
    uint32_t base = 0; // the OpVariable
    uint32_t type = 0; // of what is there
    uint32_t word = 0; // that is known now
    uint32_t matrix_stride = 0;
    bool is_known = true;
    Part index; // in words, added to `word`, if not all is known
};

// A block that branches still lead to while what stands before it is written.
struct Target {
    uint32_t block = 0;
    std::string mask; // gathers the lanes that come; empty: all of `whole` come
    size_t depth = 0; // of the stack of branches
    bool is_header = false, is_loop_merge = false, is_reached = false, is_diverged = false;
};

// Writes the C++ of a module. Values are scalars, one for all lanes (uint32_t, float, bool) or one
// a lane (U, F, B of lanes.h); vectors, matrices and structs are only names. Control flow is that
// of the shader, over masks of lanes, and what no lane runs is skipped.
//
// Which values differ between lanes shows as the code is written, so it is written again until what
// was found (Facts) no longer changes.
class Translator {
 public:
    Translator(const Module& module, std::vector<Served> served, uint32_t vectors);
    std::string run();

 private:
    struct Facts {
        std::set<std::string> varying; // phis that differ between lanes
        std::map<std::string, std::pair<int, std::string>>
            hoisted;                   // to the scope of a depth and key
        std::set<std::string> leaving; // read outside a loop that lanes leave apart
        std::set<std::string> used;
        std::set<uint32_t> diverging; // loops, by header
        bool operator==(const Facts&) const = default;
    };
    struct Scope {
        int parent = -1, depth = 0;
        std::string key, text;
    };

    // values.cpp
    void constants();
    Part literal(char kind, uint32_t bits) const;
    void resources();
    void inputs();
    void own_arrays();
    void pass();
    std::string file() const;
    std::string kernel(const Served& served, const uint32_t (&group_size)[3]) const;
    Parts parts(uint32_t id); // of an operand
    Part resolve(const Part& part);
    std::string text(const Part& part);  // marks it as used
    std::string lanes(const Part& part); // and one a lane
    std::string mask() const { return masks_.back(); }
    Part define(const std::string& name, char kind, bool uniform, const std::string& value,
                bool has_effect = false);
    void declare(const Part& part);
    void keep(const Part& part);
    bool is_wanted(const std::string& name) const;
    void line(const std::string& text) { scopes_[scope_].text += text + "\n"; }

    // memory.cpp
    Pointer pointer(uint32_t id);
    void access_chain(const Instruction& one);
    Parts load(const Pointer& from, const std::string& name);
    void store(const Pointer& to, const Parts& values);
    void atomic(const Instruction& one);
    Parts wide_atomic(const std::string& kind, const Pointer& at, const Parts& value,
                      const std::string& name);
    std::string address(const Pointer& at, uint32_t word);
    bool is_table(uint32_t variable) const;

    // images.cpp
    bool image_instruction(const Instruction& one);
    std::string coordinates(const Instruction& image_type, const Parts& at, bool floats,
                            bool& uniform);
    const Instruction& image_type(uint32_t variable) const;

    // expressions.cpp
    void instruction(const Instruction& one);
    bool composite(const Instruction& one);
    bool elementwise(const Instruction& one);
    bool algebra(const Instruction& one);
    bool group(const Instruction& one);
    void wide(uint32_t id, uint32_t op, const Parts& a, const Parts& b);
    void extended(const Instruction& one);
    Part operation(const std::string& name, const std::string& format, char kind,
                   const Parts& operands);
    Part dot(const std::string& name, const Parts& a, const Parts& b);

    // flow.cpp
    void block(uint32_t id, uint32_t from);
    void conditional(const Block& block);
    void switched(const Block& block);
    void loop(const Block& header, uint32_t from);
    void edge(uint32_t from, uint32_t to);
    void assign(const Block& to, uint32_t from, Target& target, bool diverges);
    void declare_phis(uint32_t block);
    // Declares what branches to `merge`, the merge of a selection that begins in `from`, fill.
    void await(uint32_t from, uint32_t merge);
    void arrive(Target target, const std::string& whole);
    Target* target(uint32_t block);
    bool leaves(uint32_t from, uint32_t merge) const;
    void open(const std::string& head, const std::string& key);
    void close();
    template <class Body>
    void masked(const std::string& mask, Body&& body);

    const Module& module_;
    std::vector<Served> served_;
    uint32_t vectors_;
    Facts facts_, next_;
    bool first_pass_ = true;

    std::map<uint32_t, Parts> values_;
    std::map<uint32_t, uint32_t> types_;
    std::map<uint32_t, Pointer> pointers_;
    std::map<uint32_t, uint32_t> images_; // variables and what is loaded from them: the variable
    std::set<uint32_t> inputs_;           // pointers to scalars of built-in variables
    std::vector<Variable> variables_;
    std::vector<Scope> scopes_;
    size_t scope_ = 0;
    std::string setup_; // what a launch computes once
    std::vector<std::string> masks_;
    std::vector<uint32_t> loops_;
    std::vector<bool> branches_; // those that are being written: do lanes part?
    std::vector<Target> targets_;
    std::vector<std::pair<uint32_t, const char*>> bindings_;
    std::vector<std::pair<uint32_t, uint32_t>> constants_; // SpecId and default
};

const char* cpp_type(char kind, bool uniform);

} // namespace translator
