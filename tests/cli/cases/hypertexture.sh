# A density without any input, baked, checked, viewed and baked again from its pack.
texel bake --hypertexture eroded -r 24 --seed 3 --want density,color,visibility -o rock.texel --progress never
texel check rock.texel
texel bake --recipe rock.texel -o again.texel --progress never
cmp rock.texel/volume.vdb again.texel/volume.vdb
texel view --truth rock.texel -o truth.png --size 16x16 --progress never
