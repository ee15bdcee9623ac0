// Vertices and triangles of the ball that stands for each of so many grains.
fn ball_size(grain_count: u32) -> vec2u {
    return select(vec2u(6u, 8u), vec2u(12u, 20u), grain_count <= ROUND_MAX);
}
