texel bake "" -o cube.texel
