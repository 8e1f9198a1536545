#!/bin/sh
# Makes the pictures of this folder and those of the README anew, from the repository's root. Needs a release build, ImageMagick and,
# where there is no display, xvfb-run.
set -e
resecta=${1:-target/release/resecta}
made=$(mktemp -d)

xvfb-run -a -s '-screen 0 2560x1440x24' "$resecta" gallery --out "$made"
mogrify -path docs/gallery -format jpg -quality 85 "$made"/1280x720/*.png

# The endoscope's round field is as high as the window and in the middle of what the panel leaves of it.
fields="verumontanum chip coagulated jets"
for name in $fields; do
    convert "$made/2560x1440/$name.png" -crop 1440x1440+270+0 +repage -resize 420x420 "$made/$name.png"
done
(cd "$made" && convert $(printf '%s.png ' $fields) +append -quality 88 endoscope.jpg)
mv "$made/endoscope.jpg" docs/images/endoscope.jpg
for name in play outlines; do
    convert "$made/1280x720/$name.png" -quality 88 docs/images/$name.jpg
done

# 37 frames over 4.5 s, one every 0.125 s; the stroke begins at the tenth.
"$resecta" run full_operation --script docs/gallery/stroke.ron --out "$made/stroke" --frames 37
rm "$made"/stroke/endoscope_00?.png
convert -delay 12 "$made"/stroke/endoscope_*.png -crop 720x720+120+0 +repage -resize 480x480 \
    -quality 75 -define webp:method=4 -loop 0 docs/images/stroke.webp
rm -r "$made"
