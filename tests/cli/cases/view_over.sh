# A pack repeated over a plane, a sphere and a mesh with (u,v); and what is refused.
texel bake --hypertexture eroded -r 16 --want density,color -o rock.texel --progress never
texel view rock.texel --over plane --repeat 3,2 --ground 0.2,0.3,0.1 --size 24x16 -o plane.png --progress never && echo plane
texel view rock.texel --over sphere --texel-height 0.5 --distance 2 --size 16x16 -o sphere.png --progress never && echo sphere
printf 'v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n' > quad.obj
printf 'v 0 0 1\nv 1.5 0 1\nv 1 1 1\nv 0 1 2\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n' > tips.obj
printf 'v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n' > bare.obj
texel view rock.texel --over quad.obj --repeat 2,2 --size 16x16 -o mesh.png --progress never && echo mesh
texel view rock.texel --over quad.obj --tips tips.obj --size 16x16 -o tips.png --progress never && echo tips
texel view rock.texel --over bare.obj -o no.png --progress never; echo $?
texel view rock.texel --over quad.obj --tips bare.obj -o no.png --progress never; echo $?
texel view rock.texel --over none.obj -o no.png --progress never; echo $?
texel view rock.texel --over sphere --repeat 4096,4096 -o no.png --progress never; echo $?
texel view rock.texel --over plane --repeat 5000,1 -o no.png --progress never; echo $?
texel view rock.texel --repeat 3,2 -o no.png --progress never; echo $?
texel view rock.texel --over plane --mode slices -o no.png --progress never; echo $?
texel view quad.obj --over plane -o no.png --progress never; echo $?
