texel bake --perlin-field 2,3,7 -r 16 -o p.texel && texel check p.texel && texel bake --recipe p.texel -o q.texel && cmp p.texel/volume.vdb q.texel/volume.vdb &&
  texel view --perlin-field 2,3,7 -o p.png --size 64x48
