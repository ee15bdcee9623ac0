// Node sums in fixed point, order-free: sums[(slot * planes + plane) * 512 + node].

@group(0) @binding(7) var<storage, read_write> sums: array<atomic<i32>>;

// Sums end at 128: the share of a particle that has burst to a thousand cells must not wrap them. Sound ones
// have 1.7 at most, alone with the greatest weight.
const SHARE_MAX: f32 = 4.0;

fn add(place: u32, value: f32) {
    atomicAdd(&sums[place], i32(round(min(value, SHARE_MAX) * FIXED_POINT)));
}
