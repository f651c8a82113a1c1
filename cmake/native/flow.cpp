#include <algorithm>

#include "translator.h"

namespace translator {

void Translator::open(const std::string& head, const std::string& key) {
    line(head + " {");
    scopes_.push_back({static_cast<int>(scope_), scopes_[scope_].depth + 1, key, ""});
    scope_ = scopes_.size() - 1;
}

void Translator::close() {
    const std::string text = std::move(scopes_[scope_].text);
    scopes_[scope_].text.clear();
    scopes_[scope_].key.clear(); // nothing is declared in it any more
    scope_ = static_cast<size_t>(scopes_[scope_].parent);
    scopes_[scope_].text += text + "}\n";
}

template <class Body>
void Translator::masked(const std::string& mask, Body&& body) {
    masks_.push_back(mask);
    body();
    masks_.pop_back();
}

Target* Translator::target(uint32_t block) {
    for (size_t i = targets_.size(); i-- > 0;)
        if (targets_[i].block == block)
            return &targets_[i];
    return nullptr;
}

// Whether lanes that go from a block towards the place where its branches meet may go elsewhere: to
// another place that is waited for.
bool Translator::leaves(uint32_t from, uint32_t merge) const {
    std::set<uint32_t> seen{from};
    std::vector<uint32_t> open{from};
    const auto awaited = [&](uint32_t block) {
        return std::any_of(targets_.begin(), targets_.end(),
                           [&](const Target& t) { return t.block == block; });
    };
    while (!open.empty()) {
        const Block& block = module_.blocks.at(open.back());
        open.pop_back();
        if (block.end.op == kReturn)
            return true;
        for (const uint32_t next : block.successors()) {
            if (next == merge || !seen.insert(next).second)
                continue;
            if (awaited(next))
                return true;
            open.push_back(next);
        }
    }
    return false;
}

void Translator::declare_phis(uint32_t id) {
    for (const Instruction& phi : module_.blocks.at(id).phis) {
        types_[phi.id] = phi.type;
        Parts all;
        const std::string kinds = module_.scalars(phi.type);
        for (size_t i = 0; i < kinds.size(); ++i) {
            const std::string name = fmt::format("v{}_{}", phi.id, i);
            const bool uniform = !facts_.varying.contains(name);
            variables_.push_back({name, static_cast<int>(scope_), loops_});
            all.push_back({name, kinds[i], uniform, static_cast<int>(variables_.size()) - 1});
            if (!is_wanted(name))
                continue;
            if (!facts_.hoisted.contains(name))
                line(fmt::format("{} {}{};", cpp_type(kinds[i], uniform), name,
                                 uniform ? "{}" : ""));
            declare(all.back());
        }
        values_[phi.id] = all;
    }
}

// Gives the phis of the block that a branch leads to the values that it brings.
void Translator::assign(const Block& to, uint32_t from, Target& target, bool diverges) {
    for (const Instruction& phi : to.phis) {
        size_t at = 0;
        while (at < phi.in.size() && phi.in[at + 1] != from)
            at += 2;
        if (at >= phi.in.size())
            fail("OpPhi %{} knows nothing of block %{}", phi.id, from);
        if (module_.made.contains(phi.in[at]) && module_.op(phi.in[at]) == kUndef)
            continue;
        const Parts sources = parts(phi.in[at]);
        const Parts& own = values_.at(phi.id);
        for (size_t i = 0; i < own.size(); ++i) {
            const std::string& name = own[i].text;
            if (!sources[i].uniform || (diverges && !target.is_header))
                next_.varying.insert(name);
            if (!is_wanted(name))
                continue;
            const bool uniform = !facts_.varying.contains(name);
            const std::string to_name = target.is_header ? name + "_next" : name;
            const bool whole =
                target.is_header || !diverges || (!target.is_reached && !target.is_loop_merge);
            if (uniform)
                line(fmt::format("{} = {};", to_name, text(sources[i])));
            else if (whole)
                line(fmt::format("{} = {};", to_name, lanes(sources[i])));
            else
                line(fmt::format("{0} = select({1}, {2}, {0});", to_name, mask(),
                                 lanes(sources[i])));
        }
    }
}

void Translator::edge(uint32_t from, uint32_t to) {
    Target* waiting = target(to);
    if (!waiting) {
        block(to, from);
        return;
    }
    bool diverges = waiting->is_diverged;
    for (size_t i = waiting->depth; i < branches_.size(); ++i)
        diverges |= branches_[i];
    if (waiting->is_loop_merge && diverges)
        for (const Target& header : targets_) // of the same loop: registered beside it
            if (header.is_header && header.depth == waiting->depth + 1 &&
                module_.blocks.at(header.block).merge == to)
                next_.diverging.insert(header.block);
    assign(module_.blocks.at(to), from, *waiting, diverges);
    waiting->is_reached = true;
    waiting->is_diverged |= diverges; // the other lanes come later, or not at all
    if (waiting->mask.starts_with("go"))
        line(waiting->mask + " = true;");
    else if (!waiting->mask.empty())
        line(fmt::format("{0} = lor({0}, {1});", waiting->mask, mask()));
}

// Goes on where branches meet.
void Translator::arrive(Target target, const std::string& whole) {
    const Block& block_there = module_.blocks.at(target.block);
    if (!target.is_reached && block_there.end.op == kUnreachable)
        return;
    for (const Instruction& phi : block_there.phis) {
        const Parts own = values_.at(phi.id);
        masked(target.mask.empty() ? whole : target.mask, [&] {
            for (const Part& part : own)
                if (facts_.leaving.contains(part.text) && is_wanted(part.text))
                    keep(part);
        });
    }
    if (target.mask.empty()) {
        masked(whole, [&] { block(target.block, 0); });
        return;
    }
    open(fmt::format("if (any({}))", target.mask), fmt::format("{}a", target.block));
    masked(target.mask, [&] { block(target.block, 0); });
    close();
}

// `from` is 0 where phis are filled already.
void Translator::block(uint32_t id, uint32_t from) {
    const Block& here = module_.blocks.at(id);
    if (here.continues != 0 && !target(id)) {
        loop(here, from);
        return;
    }
    if (from != 0)
        for (const Instruction& phi : here.phis) { // one way leads here
            types_[phi.id] = phi.type;
            for (size_t i = 0; i < phi.in.size(); i += 2)
                if (phi.in[i + 1] == from)
                    values_[phi.id] = parts(phi.in[i]);
        }
    for (const Instruction& one : here.body)
        instruction(one);
    switch (here.end.op) {
        case kBranch:
            edge(id, here.end.in[0]);
            return;
        case kBranchConditional:
            conditional(here);
            return;
        case kSwitch:
            switched(here);
            return;
        case kReturn:
            if (masks_.size() > 1 && !targets_.empty())
                fail("OpReturn inside of branches");
            return;
        case kUnreachable:
            return;
        default:
            fail("{} ({}) ends a block", name_of(here.end.op) ? name_of(here.end.op) : "an opcode",
                 here.end.op);
    }
}

void Translator::await(uint32_t from, uint32_t merge) {
    Target target{.block = merge, .depth = branches_.size()};
    if (leaves(from, merge)) {
        target.mask = fmt::format("m{}", merge);
        line(fmt::format("B {}(false);", target.mask));
    }
    declare_phis(merge);
    targets_.push_back(target);
}

void Translator::conditional(const Block& here) {
    const bool merges = here.merge != 0 && here.continues == 0;
    const std::string whole = mask();
    if (merges)
        await(here.id, here.merge);
    const Part condition = parts(here.end.in[0])[0];
    const uint32_t ways[2] = {here.end.in[1], here.end.in[2]};
    if (condition.uniform) {
        const std::string truth = text(condition);
        branches_.push_back(false);
        for (int i = 0; i < 2; ++i) {
            open(fmt::format("if ({}{})", i == 0 ? "" : "!", truth),
                 fmt::format("{}w{}", here.id, i));
            masked(whole, [&] { edge(here.id, ways[i]); });
            close();
        }
        branches_.pop_back();
    } else {
        const std::string names[2] = {fmt::format("t{}", here.id), fmt::format("e{}", here.id)};
        line(fmt::format("const B {} = land({}, {});", names[0], whole, text(condition)));
        line(fmt::format("const B {} = land({}, lnot({}));", names[1], whole, text(condition)));
        const bool leads_away[2] = {target(ways[0]) != nullptr, target(ways[1]) != nullptr};
        const bool one_way = !merges && (leads_away[0] || leads_away[1]);
        branches_.push_back(true);
        for (int i = 0; i < 2; ++i) // what only fills phis comes first
            if (leads_away[i]) {
                masked(names[i], [&] { edge(here.id, ways[i]); });
                if (one_way && target(ways[i]))
                    target(ways[i])->is_diverged = true;
            }
        if (one_way)
            branches_.back() = false;
        for (int i = 0; i < 2; ++i)
            if (!leads_away[i]) {
                open(fmt::format("if (any({}))", names[i]), fmt::format("{}w{}", here.id, i));
                masked(names[i], [&] { edge(here.id, ways[i]); });
                close();
            }
        branches_.pop_back();
    }
    if (merges) {
        const Target merge = targets_.back();
        targets_.pop_back();
        arrive(merge, whole);
    }
}

void Translator::switched(const Block& here) {
    const std::string whole = mask();
    await(here.id, here.merge);
    const Part selector = parts(here.end.in[0])[0];
    std::vector<uint32_t> order; // of the blocks, the default last
    std::map<uint32_t, std::string> chosen;
    const char* or_text = "lor({}, {})";
    std::string others = selector.uniform ? "true" : "B(true)";
    for (size_t i = 2; i < here.end.in.size(); i += 2) {
        const uint32_t block = here.end.in[i + 1];
        const std::string hit =
            selector.uniform ? fmt::format("({} == {}u)", text(selector), here.end.in[i])
                             : fmt::format("ieq({}, U({}u))", text(selector), here.end.in[i]);
        others = selector.uniform ? fmt::format("({} && !{})", others, hit)
                                  : fmt::format("land({}, lnot({}))", others, hit);
        if (!chosen.contains(block)) {
            order.push_back(block);
            chosen[block] = hit;
        } else {
            chosen[block] = fmt::format(fmt::runtime(or_text), chosen[block], hit);
        }
    }
    const uint32_t default_block = here.end.in[1];
    if (order.empty()) { // a block that is left by branches to its end
        masked(whole, [&] { edge(here.id, default_block); });
    } else {
        if (chosen.contains(default_block)) {
            chosen[default_block] =
                fmt::format(fmt::runtime(or_text), chosen[default_block], others);
        } else {
            order.push_back(default_block);
            chosen[default_block] = others;
        }
        // A case may lead to the next, so all of them are places to arrive at.
        std::map<uint32_t, std::string> names;
        for (size_t i = 0; i < order.size(); ++i) {
            names[order[i]] = fmt::format("s{}_{}", here.id, i);
            line(selector.uniform
                     ? fmt::format("B {}({}); {} = land({}, {});", names[order[i]],
                                   chosen[order[i]], names[order[i]], names[order[i]], whole)
                     : fmt::format("B {} = land({}, {});", names[order[i]], whole,
                                   chosen[order[i]]));
        }
        branches_.push_back(!selector.uniform);
        const size_t outer = targets_.size();
        std::vector<uint32_t> cases, ends;
        for (const uint32_t block : order)
            (target(block) ? ends : cases).push_back(block);
        for (const uint32_t block : ends) {
            open(fmt::format("if (any({}))", names[block]), fmt::format("{}s{}", here.id, block));
            masked(names[block], [&] { edge(here.id, block); });
            close();
        }
        for (auto at = cases.rbegin(); at != cases.rend(); ++at) {
            declare_phis(*at);
            targets_.push_back({.block = *at, .mask = names[*at], .depth = branches_.size() - 1});
            masked(names[*at], [&] {
                assign(module_.blocks.at(*at), here.id, targets_.back(), !selector.uniform);
            });
            targets_.back().is_reached = true;
        }
        while (targets_.size() > outer) {
            const Target next = targets_.back();
            targets_.pop_back();
            arrive(next, whole);
        }
        branches_.pop_back();
    }
    const Target after = targets_.back();
    targets_.pop_back();
    arrive(after, whole);
}

// Runs as long as a lane comes back to the header. Lanes that leave wait behind it.
void Translator::loop(const Block& header, uint32_t from) {
    const std::string whole = mask();
    const bool diverging = facts_.diverging.contains(header.id);
    declare_phis(header.merge);
    Target merge{.block = header.merge, .depth = branches_.size(), .is_loop_merge = true};
    targets_.push_back(merge);
    // Phis start with what comes from before the loop.
    const auto outer_loops = loops_;
    loops_.push_back(header.id);
    declare_phis(header.id);
    loops_ = outer_loops;
    Target entry{.block = header.id, .depth = branches_.size(), .is_header = false};
    assign(header, from, entry, false);
    for (const Instruction& phi : header.phis)
        for (const Part& part : values_.at(phi.id))
            if (is_wanted(part.text))
                line(fmt::format("{} {}_next{};", cpp_type(part.kind, part.uniform), part.text,
                                 part.uniform ? "{}" : ""));
    const std::string here = diverging ? fmt::format("l{}", header.id) : whole;
    const std::string again =
        diverging ? fmt::format("again{}", header.id) : fmt::format("go{}", header.id);
    if (diverging)
        line(fmt::format("B {} = {};", here, whole));
    loops_.push_back(header.id);
    open("for (;;)", fmt::format("{}l", header.id));
    line(diverging ? fmt::format("B {}(false);", again) : fmt::format("bool {} = false;", again));
    branches_.push_back(diverging);
    targets_.push_back(
        {.block = header.id, .mask = again, .depth = branches_.size(), .is_header = true});
    const uint32_t continues = header.continues;
    size_t ways = 0;
    for (const auto& [id, block] : module_.blocks)
        for (const uint32_t next : block.successors())
            ways += next == continues;
    const bool gathers = continues != header.id && ways > 1;
    if (gathers) {
        Target next{.block = continues, .depth = branches_.size()};
        if (leaves(header.id, continues)) {
            next.mask = fmt::format("m{}", continues);
            line(fmt::format("B {}(false);", next.mask));
        }
        declare_phis(continues);
        targets_.push_back(next);
    }
    masked(here, [&] {
        for (const Instruction& phi : header.phis)
            for (const Part& part : values_.at(phi.id))
                if (facts_.leaving.contains(part.text) && is_wanted(part.text))
                    keep(part);
        block(header.id, 0);
    });
    if (gathers) {
        const Target next = targets_.back();
        targets_.pop_back();
        arrive(next, here);
    }
    targets_.pop_back();
    branches_.pop_back();
    line(diverging ? fmt::format("{0} = {1}; if (!any({0})) break;", here, again)
                   : fmt::format("if (!{}) break;", again));
    for (const Instruction& phi : header.phis)
        for (const Part& part : values_.at(phi.id))
            if (is_wanted(part.text))
                line(fmt::format("{0} = {0}_next;", part.text));
    close();
    loops_.pop_back();
    const Target after = targets_.back();
    targets_.pop_back();
    arrive(after, whole);
}

} // namespace translator
