// Node sums in fixed point, order-free: sums[(slot * planes + plane) * 512 + node].

@group(0) @binding(7) var<storage, read_write> sums: array<atomic<i32>>;

fn add(place: u32, value: f32) {
    atomicAdd(&sums[place], i32(round(value * FIXED_POINT)));
}
