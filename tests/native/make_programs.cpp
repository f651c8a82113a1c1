// make_programs SEED COUNT SHADER TWIN
//
// Writes COUNT random functions twice: as a compute shader, and as a header of C++ with the same
// text. All that they do is defined in both languages and exact: whole numbers of 32 bits that
// wrap, and floats that hold whole or half numbers below 2^24. Every loop ends. They read a
// picture, keep a number in a pixel of their own, and change shared numbers by atomics whose order
// does not matter. What a subgroup says to itself stands in stages behind the functions, since one
// invocation alone cannot compute it.
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

namespace {

class Program {
 public:
    explicit Program(uint64_t seed) : state_(seed) {}

    // uint f<number>(uint a, uint b). Functions below `helpers` may be called.
    std::string function(int number, int helpers) {
        helpers_ = helpers;
        names_ = loops_ = depth_ = 0;
        std::string out = "uint f" + std::to_string(number) + "(uint a, uint b) {\n" +
                          "uint c = a ^ (b << 3), d = 5u;\nuint t[5];\n" +
                          "for (uint i = 0u; i < 5u; ++i)\nt[i] = a + i * b;\n";
        return out + statements(3) + "return a ^ b * 3u ^ c * 5u ^ d ^ t[(a ^ d) % 5u];\n}\n";
    }

    // All lanes compute r = f(a, b); those for which a condition holds change a by what they hear.
    struct Stage {
        std::string function, condition, operation;
    };
    Stage stage(int functions) {
        const char* operations[] = {"kAdd",   "kInclusive", "kExclusive", "kFirst",
                                    "kElect", "kAny",       "kAll",       "kLoop"};
        const std::string mask = std::to_string(1u << below(5)) + "u";
        const std::string conditions[] = {"true", "(r & " + mask + ") != 0u", "r < a",
                                          "(a & " + mask + ") == 0u", "int(r) < int(b)"};
        return {"f" + std::to_string(below(static_cast<uint32_t>(functions))), conditions[below(5)],
                operations[below(8)]};
    }

 private:
    uint32_t below(uint32_t n) { // splitmix64
        uint64_t z = state_ += 0x9e3779b97f4a7c15u;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return static_cast<uint32_t>((z ^ (z >> 31)) >> 33) % n;
    }
    std::string variable() { return std::string(1, static_cast<char>('a' + below(4))); }
    std::string name(char kind) { return kind + std::to_string(names_++); }

    std::string number(int depth) {
        if (depth == 0 || below(4) == 0)
            return below(3) == 0   ? std::to_string(below(70)) + "u"
                   : below(4) == 0 ? "t[" + variable() + " % 5u]"
                                   : variable();
        const std::string x = number(depth - 1), y = number(depth - 1);
        const char* binary[] = {"+", "-", "*", "&", "|", "^"};
        switch (below(16)) {
            case 14:
                return "texel(" + x + ", " + y + ")";
            case 15:
                return below(2) ? "kept()" : "texel(" + x + " & 7u, " + y + " & 7u)";
            case 0:
                return "(" + x + " << (" + y + " & 31u))";
            case 1:
                return "(" + x + " >> (" + y + " & 31u))";
            case 2:
                return "uint(int(" + x + ") >> int(" + y + " & 31u))";
            case 3:
                return "(" + x + (below(2) ? " / " : " % ") + "(" + y + " | 1u))";
            case 4:
                return "(" + condition(depth - 1) + " ? " + x + " : " + y + ")";
            case 5: // at most 1023 * 255 + 511.5
                return "uint(floor(float(" + x + " & 1023u) * float(" + y + " & 255u) + float(" +
                       x + " & 1023u) * 0.5f))";
            case 6:
                return "uint(clamp(float(int(" + x +
                       " & 4095u) - 2048) + 0.5f, -100.0f, 1500.0f) + "
                       "100.0f)";
            case 7:
                return (below(2) ? "min(" : "max(") + x + ", " + y + ")";
            case 8:
                return "uint(0 + min(int(" + x + "), int(" + y + ")))";
            case 9:
                if (helpers_ > 0 && below(3) == 0)
                    return "f" + std::to_string(below(static_cast<uint32_t>(helpers_))) + "(" + x +
                           ", " + y + ")";
                [[fallthrough]];
            default:
                return "(" + x + " " + binary[below(6)] + " " + y + ")";
        }
    }
    std::string condition(int depth) {
        const char* compare[] = {"<", ">", "<=", ">=", "==", "!="};
        const std::string x = number(depth > 0 ? depth - 1 : 0), y = number(0);
        switch (below(6)) {
            case 0:
                return "(int(" + x + ") " + compare[below(6)] + " int(" + y + "))";
            case 1:
                return "(float(" + x + " & 255u) " + compare[below(6)] + " float(" + y + " & 63u))";
            case 2:
                if (depth > 0)
                    return "(" + condition(depth - 1) + (below(2) ? " && " : " || ") +
                           condition(depth - 1) + ")";
                [[fallthrough]];
            case 3: // true for some of the lanes
                return "((" + x + " & " + std::to_string(1u << below(4)) + "u) != 0u)";
            default:
                return "(" + x + " " + compare[below(6)] + " " + y + ")";
        }
    }
    std::string statements(int count) {
        std::string out;
        for (int i = 0; i < count; ++i)
            out += statement();
        return out;
    }
    std::string body() {
        ++depth_;
        const std::string out = "{\n" + statements(1 + static_cast<int>(below(2))) + "}\n";
        --depth_;
        return out;
    }
    std::string loop_body() {
        ++loops_;
        const std::string out = body();
        --loops_;
        return out;
    }
    std::string statement() {
        switch (depth_ > 2 ? below(3) : below(12)) {
            case 10:
                return "keep(" + number(2) + ");\n";
            case 11: {
                const char* kinds[] = {"add", "or", "xor", "and", "min", "max"};
                return std::string("bin_") + kinds[below(6)] + "(" + number(1) + ", " + number(2) +
                       ");\n";
            }
            case 0:
                return "t[" + number(1) + " % 5u] = " + number(2) + ";\n";
            case 3:
                return "if " + condition(2) + " " + body();
            case 4:
                return "if " + condition(2) + " " + body() + "else " + body();
            case 5: {
                const std::string i = name('i');
                return "for (uint " + i + " = 0u; " + i + " < (" + number(1) + " & 7u) && " + i +
                       " < 7u; ++" + i + ") " + loop_body();
            }
            case 6: {
                const std::string n = name('n');
                return "uint " + n + " = 0u;\ndo {\n++" + n + ";\n" + variable() + " += " + n +
                       ";\n" + loop_body() + "} while (" + n + " < 5u && " + condition(1) + ");\n";
            }
            case 7: {
                std::string out = "switch (" + number(1) + " & 3u) {\n";
                for (const char* label : {"case 0u:\n", "case 2u:\n", "default:\n"})
                    out += label + body() + (below(3) == 0 && label[0] == 'c' ? "" : "break;\n");
                return out + "}\n";
            }
            case 8:
                if (loops_ > 0)
                    return "if " + condition(1) + (below(2) ? " continue;\n" : " break;\n");
                [[fallthrough]];
            case 9:
                if (below(4) == 0)
                    return "if " + condition(1) + " return " + number(2) + ";\n";
                [[fallthrough]];
            default:
                return variable() + " " +
                       (below(2)   ? ""
                        : below(2) ? "^"
                                   : "+") +
                       "= " + number(3) + ";\n";
        }
    }

    uint64_t state_;
    int helpers_ = 0, names_ = 0, loops_ = 0, depth_ = 0;
};

// Four bins for each of the operations.
constexpr const char* kShader = R"(#version 460
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require
layout(local_size_x = 64) in;
layout(binding = 0) readonly buffer Values { uint values[]; };
layout(binding = 1) writeonly buffer Results { uint results[]; };
layout(binding = 2) buffer Bins { uint bins[24]; };
layout(binding = 3) uniform usampler2D picture;
layout(binding = 4, r32ui) uniform uimage2D kept_image;
shared uint row[64];
uint texel(uint x, uint y) { return texelFetch(picture, ivec2(x, y), 0).r; }
ivec2 own() { return ivec2(gl_LocalInvocationID.x, gl_WorkGroupID.x); }
uint kept() { return imageLoad(kept_image, own()).r; }
void keep(uint x) { imageStore(kept_image, own(), uvec4(x)); }
void bin_add(uint at, uint x) { atomicAdd(bins[at & 3u], x); }
void bin_or(uint at, uint x) { atomicOr(bins[4u + (at & 3u)], x); }
void bin_xor(uint at, uint x) { atomicXor(bins[8u + (at & 3u)], x); }
void bin_and(uint at, uint x) { atomicAnd(bins[12u + (at & 3u)], x); }
void bin_min(uint at, uint x) { atomicMin(bins[16u + (at & 3u)], x); }
void bin_max(uint at, uint x) { atomicMax(bins[20u + (at & 3u)], x); }
#define kAdd a ^= subgroupAdd(r)
#define kInclusive a ^= subgroupInclusiveAdd(r)
#define kExclusive a ^= subgroupExclusiveAdd(r)
#define kFirst a ^= subgroupBroadcastFirst(r)
#define kElect a ^= uint(subgroupElect())
#define kAny a ^= uint(subgroupAny((r & 2u) != 0u))
#define kAll a ^= uint(subgroupAll((r & 2u) != 0u))
#define kLoop for (uint i = 0u; i < (r & 3u); ++i) a += subgroupAdd(r + i)
)";

} // namespace

int main(int argc, char** argv) {
    if (argc != 5)
        return 1;
    const int count = std::atoi(argv[2]), helpers = 3;
    std::string functions;
    Program program(std::strtoull(argv[1], nullptr, 10));
    for (int i = 0; i < count; ++i)
        functions += program.function(i, i < helpers ? 0 : helpers);
    const std::string stride = std::to_string(count + 1) + "u";
    std::string calls, twin_calls;
    for (int i = 0; i < count; ++i) { // some arguments are the same in all lanes
        const std::string a = i % 3 == 0 ? "group" : "a", b = i % 6 == 3 ? "group * 7u" : "b";
        const std::string call = "f" + std::to_string(i) + "(" + a + ", " + b + ")";
        calls += "results[" + stride + " * id + " + std::to_string(i) + "u] = " + call + ";\n";
        twin_calls += "out[" + std::to_string(i) + "] = " + call + ";\n";
    }
    std::string stages, twin_stages;
    for (int i = 0; i < 12; ++i) {
        const Program::Stage stage = program.stage(count);
        stages += "{\nuint r = " + stage.function + "(a, b);\nif (" + stage.condition + ") { " +
                  stage.operation + "; }\n}\n";
        twin_stages += "group.stage(" + stage.function +
                       ", [](uint a, uint b, uint r) { return a == a && b == b && r == r && (" +
                       stage.condition + "); }, Said::" + stage.operation + ");\n";
    }
    std::ofstream(argv[3]) << kShader << functions
                           << "void main() {\nuint id = gl_GlobalInvocationID.x, group = "
                              "gl_WorkGroupID.x, lane = gl_LocalInvocationID.x;\n"
                              "uint a = values[2u * id], b = values[2u * id + 1u];\n"
                           << calls
                           << "#if defined(HAS_BARRIER) && HAS_BARRIER\n"
                              "row[lane] = a;\nbarrier();\nuint other = row[(lane + 7u) & 63u];\n"
                              "barrier();\nrow[63u - lane] = b;\nbarrier();\n"
                              "results["
                           << stride << " * id] = other ^ row[lane];\n#endif\n"
                           << stages << "results[" << stride << " * id + " << count
                           << "u] = a;\n}\n";
    std::ofstream(argv[4]) << functions
                           << "inline void run_all(uint group, uint a, uint b, uint* out) {\n"
                           << twin_calls << "}\ninline void run_stages(Group& group) {\n"
                           << twin_stages << "}\ninline constexpr uint kFunctions = " << count
                           << ";\n";
    return 0;
}
