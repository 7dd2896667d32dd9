# Each texel has its own objects and recipe; the command line beats both; a batch bakes all of them.
mkdir in; cp "$DATA"/cube.* in/; cd in
printf '{"format": "texel-scene", "inputs": {"cube": "cube.obj"}, "recipe": {"resolution": 8, "want": "density"}, "texels": [
  {"name": "one", "objects": [{"input": "cube"}]},
  {"name": "two", "objects": [{"input": "cube"}, {"input": "cube", "transform": {"translate": [4, 0, 0]}}], "recipe": {"voxel_size": 0.5, "margin": 0}}]}' > s.json
echo '{"other": 1}' > other.json; cd ..
texel bake in/s.json -o x.texel
texel bake in/s.json --texel three -o x.texel
texel bake in/s.json --texel two -o two.texel && texel bake in/s.json --texel two -r 12 -o fine.texel && texel bake --recipe fine.texel -o again.texel
texel batch in -o out --want density > /dev/null; ls out
texel batch in -o out --want density | grep -v '^ *$'
texel view in/s.json --texel two -o two.png --size 32x32 --samples 1 && ls two.png
texel bake in/cube.obj --texel two -o x.texel
