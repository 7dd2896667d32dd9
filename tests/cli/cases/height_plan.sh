cp "$ROOT/samples/terrain/crater.png" . && texel bake crater.png --extent 4,3 --height 1 -r 32 --plan && texel bake --perlin-field 2,3,7 -r 16 --plan
