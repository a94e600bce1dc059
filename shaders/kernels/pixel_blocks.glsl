// Which pixel an invocation renders. Neighbours in a subgroup are neighbours in the image, in blocks of 8 x 4 pixels,
// so that their rays meet the same things.
#ifndef PIXEL_BLOCKS_GLSL
#define PIXEL_BLOCKS_GLSL

const uint block_width = 8, block_height = 4;

// The place in the tile of its invocation i, each place being some invocation's. Bands of four rows hold blocks from left
// to right; blocks at the right and lower rim are what remains. A tile that is not the whole image goes row by row.
uint place_of(uint i) {
    if (settings.pixel_count != settings.width * settings.height) return i;
    const uint band = i / (block_height * settings.width), within = i - band * block_height * settings.width;
    const uint rows = min(block_height, settings.height - band * block_height);
    const uint block = within / (block_width * rows), in_block = within - block * block_width * rows;
    const uint columns = min(block_width, settings.width - block * block_width);
    const uint x = block * block_width + in_block % columns, y = band * block_height + in_block / columns;
    return y * settings.width + x;
}

#endif
