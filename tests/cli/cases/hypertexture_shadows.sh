texel bake --hypertexture fire -r 16 --shadows -o fire.texel --progress never
