"""Prints the nearest depth in every message.  How to run it: see docs/lcm.md"""
import struct

import lcm
from shef import depth_t


def on_depth(channel, data):
    m = depth_t.decode(data)
    grid_w = -(-m.width // m.grid_step)
    row_bytes = (grid_w + 7) // 8
    values_at, sigmas_at = m.n_rows * row_bytes, m.n_rows * row_bytes + 2 * m.n_points
    depths = struct.unpack_from(f"<{m.n_points}H", m.data, values_at)
    cells = [(x, m.first_row + y) for y in range(m.n_rows) for x in range(grid_w)
             if m.data[y * row_bytes + x // 8] >> x % 8 & 1]  # of the depths, in their order
    text = f"{channel} {m.header.seq}: {len(cells)} points"
    if depths:
        i = min(range(m.n_points), key=depths.__getitem__)
        code = m.data[sigmas_at + i]
        sigma = m.unit_m * (1 + (code & 15) / 16) * 2 ** (code >> 4)
        text += f", nearest {depths[i] * m.unit_m:.4f} m +- {sigma:.4f}"
    print(text, flush=True)


bus = lcm.LCM("udpm://239.255.76.67:7667?recv_buf_size=2097152")
bus.subscribe("SHEF_DEPTH", on_depth)
while True:
    bus.handle()
