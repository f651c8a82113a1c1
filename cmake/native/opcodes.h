#pragma once

#include <cstdint>

// Numbers of the SPIR-V specification 1.6 and of GLSL.std.450, as far as the engine's shaders use
// them. Lists of macros, so that names can be printed.
namespace translator {

// clang-format off
#define PALPATE_OPCODES(X)                                                                        \
    X(Undef, 1) X(Name, 5) X(MemberName, 6) X(ExtInst, 12) X(EntryPoint, 15)                      \
    X(ExecutionMode, 16) X(TypeVoid, 19) X(TypeBool, 20) X(TypeInt, 21) X(TypeFloat, 22)          \
    X(TypeVector, 23) X(TypeMatrix, 24) X(TypeImage, 25) X(TypeSampler, 26)                       \
    X(TypeSampledImage, 27) X(TypeArray, 28) X(TypeRuntimeArray, 29) X(TypeStruct, 30)            \
    X(TypePointer, 32) X(TypeFunction, 33) X(ConstantTrue, 41) X(ConstantFalse, 42)               \
    X(Constant, 43) X(ConstantComposite, 44) X(ConstantNull, 46) X(SpecConstantTrue, 48)          \
    X(SpecConstantFalse, 49) X(SpecConstant, 50) X(SpecConstantComposite, 51)                     \
    X(SpecConstantOp, 52) X(Function, 54) X(FunctionEnd, 56) X(Variable, 59)                      \
    X(ImageTexelPointer, 60) X(Load, 61) X(Store, 62) X(AccessChain, 65) X(ArrayLength, 68)       \
    X(Decorate, 71) X(MemberDecorate, 72) X(VectorExtractDynamic, 77) X(VectorShuffle, 79)        \
    X(CompositeConstruct, 80) X(CompositeExtract, 81) X(CompositeInsert, 82) X(CopyObject, 83)    \
    X(Transpose, 84) X(ImageSampleExplicitLod, 88) X(ImageFetch, 95) X(ImageRead, 98)             \
    X(ImageWrite, 99) X(Image, 100) X(ImageQuerySizeLod, 103) X(ImageQuerySize, 104)              \
    X(ConvertFToU, 109) X(ConvertFToS, 110) X(ConvertSToF, 111) X(ConvertUToF, 112)               \
    X(Bitcast, 124) X(SNegate, 126) X(FNegate, 127) X(IAdd, 128) X(FAdd, 129) X(ISub, 130)        \
    X(FSub, 131) X(IMul, 132) X(FMul, 133) X(UDiv, 134) X(SDiv, 135) X(FDiv, 136) X(UMod, 137)    \
    X(SRem, 138) X(SMod, 139) X(FMod, 141) X(VectorTimesScalar, 142) X(MatrixTimesScalar, 143)    \
    X(VectorTimesMatrix, 144) X(MatrixTimesVector, 145) X(MatrixTimesMatrix, 146) X(Dot, 148)     \
    X(Any, 154) X(All, 155) X(IsNan, 156) X(IsInf, 157) X(LogicalEqual, 164)                      \
    X(LogicalNotEqual, 165) X(LogicalOr, 166) X(LogicalAnd, 167) X(LogicalNot, 168)               \
    X(Select, 169) X(IEqual, 170) X(INotEqual, 171) X(UGreaterThan, 172) X(SGreaterThan, 173)     \
    X(UGreaterThanEqual, 174) X(SGreaterThanEqual, 175) X(ULessThan, 176) X(SLessThan, 177)       \
    X(ULessThanEqual, 178) X(SLessThanEqual, 179) X(FOrdEqual, 180) X(FUnordEqual, 181)           \
    X(FOrdNotEqual, 182) X(FUnordNotEqual, 183) X(FOrdLessThan, 184) X(FUnordLessThan, 185)       \
    X(FOrdGreaterThan, 186) X(FUnordGreaterThan, 187) X(FOrdLessThanEqual, 188)                   \
    X(FUnordLessThanEqual, 189) X(FOrdGreaterThanEqual, 190) X(FUnordGreaterThanEqual, 191)       \
    X(ShiftRightLogical, 194) X(ShiftRightArithmetic, 195) X(ShiftLeftLogical, 196)               \
    X(BitwiseOr, 197) X(BitwiseXor, 198) X(BitwiseAnd, 199) X(Not, 200) X(BitFieldInsert, 201)    \
    X(BitFieldSExtract, 202) X(BitFieldUExtract, 203) X(BitReverse, 204) X(BitCount, 205)         \
    X(ControlBarrier, 224) X(MemoryBarrier, 225) X(AtomicLoad, 227) X(AtomicStore, 228)           \
    X(AtomicExchange, 229) X(AtomicCompareExchange, 230) X(AtomicIAdd, 234) X(AtomicISub, 235)    \
    X(AtomicSMin, 236) X(AtomicUMin, 237) X(AtomicSMax, 238) X(AtomicUMax, 239)                   \
    X(AtomicAnd, 240) X(AtomicOr, 241) X(AtomicXor, 242) X(Phi, 245) X(LoopMerge, 246)            \
    X(SelectionMerge, 247) X(Label, 248) X(Branch, 249) X(BranchConditional, 250) X(Switch, 251)  \
    X(Return, 253) X(Unreachable, 255) X(ExecutionModeId, 331) X(GroupNonUniformElect, 333)       \
    X(GroupNonUniformAll, 334) X(GroupNonUniformAny, 335) X(GroupNonUniformBroadcastFirst, 338)   \
    X(GroupNonUniformIAdd, 349) X(CopyLogical, 400)
// clang-format on

enum Op : uint32_t {
#define PALPATE_ENUM(name, number) k##name = number,
    PALPATE_OPCODES(PALPATE_ENUM)
#undef PALPATE_ENUM
};

inline const char* name_of(uint32_t op) {
    switch (op) {
#define PALPATE_NAME(name, number) \
    case number:                   \
        return "Op" #name;
        PALPATE_OPCODES(PALPATE_NAME)
#undef PALPATE_NAME
        default:
            return nullptr;
    }
}

enum Decoration : uint32_t {
    kSpecId = 1,
    kBlock = 2,
    kArrayStride = 6,
    kMatrixStride = 7,
    kBuiltIn = 11,
    kBinding = 33,
    kDescriptorSet = 34,
    kOffset = 35
};

enum StorageClass : uint32_t {
    kUniformConstant = 0,
    kInput = 1,
    kUniform = 2,
    kWorkgroup = 4,
    kPrivate = 6,
    kFunctionClass = 7,
    kPushConstant = 9,
    kImageClass = 11,
    kStorageBuffer = 12
};

enum BuiltIn : uint32_t {
    kNumWorkgroups = 24,
    kWorkgroupSize = 25,
    kWorkgroupId = 26,
    kLocalInvocationId = 27,
    kGlobalInvocationId = 28,
    kLocalInvocationIndex = 29,
    kSubgroupSize = 36,
    kSubgroupLocalInvocationId = 41
};

} // namespace translator
