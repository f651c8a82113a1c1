// Division and square root to the nearest float, which Vulkan does not promise: it allows 2.5 units in
// the last place for one and more for the other. Integers put right what the device finds, so that
// every device has the bits of IEEE 754, and of the CPU. What is left over by an approximation is
// smaller than 2^31, so the lowest 32 bits tell it exactly.

// a / b, for a >= 0 and b > 0; 0 where either is not a normal number or the quotient is none.
float exact_quotient(float a, float b) {
    const uint bits_a = floatBitsToUint(a), bits_b = floatBitsToUint(b);
    const int exponent_a = int(bits_a >> 23 & 0xffu), exponent_b = int(bits_b >> 23 & 0xffu);
    const uint m = (bits_a & 0x7fffffu) | 0x800000u, n = (bits_b & 0x7fffffu) | 0x800000u;
    const uint shift = m < n ? 24u : 23u; // so that the quotient has 24 bits
    const float rough = float(m) / float(n) * (shift == 24u ? 16777216.0 : 8388608.0);
    uint q = uint(rough);
    int rest = int((m << shift) - q * n);
    const int steps = int(floor(float(rest) / float(n)));
    q += uint(steps);
    rest -= steps * int(n);
    const int low = rest < 0 ? 1 : 0, high = rest >= int(n) ? 1 : 0;
    q += uint(high - low);
    rest += (low - high) * int(n);
    q += 2 * rest > int(n) || (2 * rest == int(n) && (q & 1u) != 0u) ? 1u : 0u;
    const int exponent = exponent_a - exponent_b + (shift == 24u ? 126 : 127);
    const bool usable = exponent_a > 0 && exponent_a < 255 && exponent_b > 0 && exponent_b < 255 &&
                        exponent > 0 && exponent < 255;
    return usable ? uintBitsToFloat((uint(exponent) << 23) + (q - 0x800000u)) : 0.0;
}

// The root of a normal number above 0.
float exact_root(float a) {
    const uint bits = floatBitsToUint(a);
    const int exponent = int(bits >> 23) - 127;
    const uint m = (bits & 0x7fffffu) | 0x800000u;
    const uint shift = (exponent & 1) == 0 ? 23u : 24u; // root of m 2^shift: 24 bits
    uint root = uint(sqrt(float(m) * (shift == 24u ? 16777216.0 : 8388608.0)));
    int rest = int((m << shift) - root * root);
    root += uint(int(floor(float(rest) / (2.0 * float(root)))));
    rest = int((m << shift) - root * root);
    const uint low = rest < 0 ? 1u : 0u;
    root -= low;
    rest += low != 0u ? int(2u * root + 1u) : 0;
    const uint high = rest > int(2u * root) ? 1u : 0u;
    rest -= high != 0u ? int(2u * root + 1u) : 0;
    root += high;
    root += rest > int(root) ? 1u : 0u; // beyond the middle, (root + 1/2)^2; never on it
    const int half_exponent = (exponent - (exponent & 1)) / 2;
    return uintBitsToFloat((uint(half_exponent + 127) << 23) + (root - 0x800000u));
}
