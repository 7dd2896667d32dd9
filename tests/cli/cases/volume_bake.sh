printf "NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = v.raw\n" > v.mhd
printf 01234567 > v.raw
texel bake v.mhd --iso 52 -r 12 --want density -o x.texel --depfile x.d && texel check x.texel && cat x.d && texel bake --recipe x.texel -o y.texel && diff -r x.texel y.texel && echo the same
