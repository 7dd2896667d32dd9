texel bake --hypertexture octaves -r 8 --want color -o cube.texel --progress never
texel view cube.texel --mode zoom --size 8x8 -o zoom.png --progress never
python3 -c "import struct; print(struct.unpack('>II', open('zoom.png', 'rb').read()[16:24]))"
texel view "$DATA/cube.obj" --mode zoom -o no.png --progress never
